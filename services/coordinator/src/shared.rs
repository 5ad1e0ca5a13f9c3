//! Answers that are shared by all who ask for the same at the same time, so that the database is asked once, however many poll.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Most things that are kept an answer about; beyond, those that nobody asks for are let go.
const MOST: usize = 100;

/// The last answer about each of many things. Clones share them.
///
/// Nobody gets an answer that is older than their question: of those who ask while another's question is under way, the first
/// asks again when that has ended, for all of them. So there is one question at a time about each thing, and an answer is as
/// fresh as if each had asked alone.
#[derive(Clone, Debug)]
pub(crate) struct Shared<V> {
    kept: Arc<Mutex<HashMap<String, Arc<Kept<V>>>>>,
}

/// When the last question began, and its answer.
type Kept<V> = tokio::sync::Mutex<Option<(Instant, V)>>;

impl<V> Default for Shared<V> {
    fn default() -> Self {
        Self { kept: Arc::default() }
    }
}

impl<V: Clone> Shared<V> {
    /// The answer about a thing. `ask` is given the answer before, which it may give again if it still holds.
    ///
    /// # Errors
    /// Those of `ask`.
    pub(crate) async fn get<E, A: Future<Output = Result<V, E>>>(
        &self,
        thing: &str,
        ask: impl FnOnce(Option<V>) -> A,
    ) -> Result<V, E> {
        let came = Instant::now();
        let place = self.place(thing);
        let mut kept = place.lock().await;
        if let Some((begun, value)) = &*kept
            && *begun > came
        {
            return Ok(value.clone());
        }
        let begun = Instant::now();
        // Nothing is left behind by a question that fails, or whose client has gone.
        let value = ask(kept.take().map(|(_, value)| value)).await?;
        *kept = Some((begun, value.clone()));
        Ok(value)
    }

    fn place(&self, thing: &str) -> Arc<Kept<V>> {
        let mut all = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = all.get(thing) {
            return Arc::clone(place);
        }
        if all.len() >= MOST {
            all.retain(|_, place| Arc::strong_count(place) > 1);
        }
        Arc::clone(all.entry(thing.to_owned()).or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    #[tokio::test]
    async fn those_who_ask_together_share_an_answer_that_is_not_older_than_their_question() {
        let shared = Shared::default();
        let (asked, truth) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let all: Vec<_> = (0..50)
            .map(|number| {
                let (shared, asked, truth) = (shared.clone(), Arc::clone(&asked), Arc::clone(&truth));
                tokio::spawn(async move {
                    tokio::time::sleep(Duration::from_millis(number)).await;
                    let at_least = truth.fetch_add(1, Ordering::SeqCst) + 1;
                    let (asked, truth) = (&asked, &truth);
                    let found = shared.get("a", |_| async move {
                        asked.fetch_add(1, Ordering::SeqCst);
                        let found = truth.load(Ordering::SeqCst);
                        tokio::time::sleep(Duration::from_millis(20)).await;
                        Ok::<_, Infallible>(found)
                    });
                    let found = found.await.expect("an answer");
                    assert!(found >= at_least, "{found} is older than {at_least}");
                })
            })
            .collect();
        for one in all {
            one.await.expect("it ends");
        }
        let asked = asked.load(Ordering::SeqCst);
        assert!((2..=10).contains(&asked), "{asked} questions for 50 who asked within 50 ms");
    }

    #[tokio::test]
    async fn an_answer_that_holds_is_given_again_and_an_error_is_not_kept() {
        let shared = Shared::default();
        assert_eq!(shared.get("a", |before: Option<i32>| async move { Err::<i32, _>(before) }).await, Err(None));
        assert_eq!(shared.get("a", |before| async move { Ok::<_, ()>(before.map_or(7, |b: i32| b + 1)) }).await, Ok(7));
        assert_eq!(shared.get("b", |before| async move { Ok::<_, ()>(before.unwrap_or(0)) }).await, Ok(0));
        assert_eq!(shared.get("a", |before| async move { Ok::<_, ()>(before.map_or(7, |b| b + 1)) }).await, Ok(8));
    }

    #[tokio::test]
    async fn what_nobody_asks_for_is_let_go() {
        let shared = Shared::default();
        for number in 0..3 * MOST {
            shared.get(&number.to_string(), |_| async move { Ok::<_, ()>(number) }).await.expect("an answer");
        }
        assert!(shared.kept.lock().unwrap().len() <= MOST);
    }
}
