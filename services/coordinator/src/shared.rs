//! Answers that are shared by all who ask for the same, so that the database is asked seldom, however many poll.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Most things that are kept an answer about; beyond, those that nobody asks for are let go.
const MOST: usize = 1000;

/// How old an answer for one who polls may be, unless a client changed something through this process since. What workers and other
/// processes did is told after that time at the latest.
const LATELY: Duration = Duration::from_millis(250);

/// The last answer about each of many things. Clones share them.
///
/// Of those who ask while another's question is under way, the first asks again when that has ended, for all of them. So there is
/// one question at a time about each thing.
#[derive(Clone, Debug)]
pub(crate) struct Shared<V> {
    kept: Arc<Mutex<HashMap<String, Arc<Place<V>>>>>,
}

#[derive(Debug)]
struct Place<V> {
    last: Mutex<Option<Answer<V>>>,
    asking: tokio::sync::Mutex<()>,
}

#[derive(Clone, Debug)]
struct Answer<V> {
    /// When the question began.
    begun: Instant,
    /// The number of changes by clients before it began.
    writes: u64,
    value: V,
}

/// How fresh an answer has to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Freshness {
    came: Instant,
    writes: u64,
    lately: bool,
}

impl Freshness {
    /// Not older than the question, as if each had asked alone. `writes` is the number of changes by clients so far.
    pub(crate) fn now(writes: u64) -> Self {
        Self { came: Instant::now(), writes, lately: false }
    }

    /// A short time old at most, and with all in it that clients have changed through this process.
    pub(crate) fn lately(writes: u64) -> Self {
        Self { lately: true, ..Self::now(writes) }
    }

    fn allows<V>(&self, answer: &Answer<V>) -> bool {
        let age = self.came.saturating_duration_since(answer.begun);
        answer.begun > self.came || (self.lately && answer.writes == self.writes && age < LATELY)
    }
}

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
        freshness: Freshness,
        ask: impl FnOnce(Option<V>) -> A,
    ) -> Result<V, E> {
        let place = self.place(thing);
        if let Some(answer) = place.last().filter(|answer| freshness.allows(answer)) {
            return Ok(answer.value);
        }
        let _turn = place.asking.lock().await;
        let last = place.last();
        if let Some(answer) = last.as_ref().filter(|answer| freshness.allows(answer)) {
            return Ok(answer.value.clone());
        }
        let begun = Instant::now();
        let answered = ask(last.map(|answer| answer.value)).await;
        let kept = answered.as_ref().ok().map(|value| Answer { begun, writes: freshness.writes, value: value.clone() });
        *place.last.lock().unwrap_or_else(PoisonError::into_inner) = kept;
        answered
    }

    fn place(&self, thing: &str) -> Arc<Place<V>> {
        let mut all = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = all.get(thing) {
            return Arc::clone(place);
        }
        if all.len() >= MOST {
            all.retain(|_, place| Arc::strong_count(place) > 1);
        }
        let place = Arc::new(Place { last: Mutex::default(), asking: tokio::sync::Mutex::default() });
        all.insert(thing.to_owned(), Arc::clone(&place));
        place
    }
}

impl<V: Clone> Place<V> {
    fn last(&self) -> Option<Answer<V>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;
    use std::sync::atomic::{AtomicUsize, Ordering};

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
                    let found = shared.get("a", Freshness::now(0), |_| async move {
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
    async fn those_who_poll_get_an_answer_again_for_a_while_unless_something_changed_here() {
        let shared = Shared::default();
        let asked = AtomicUsize::new(0);
        let get = async |freshness| {
            let ask = |_| async { Ok::<_, Infallible>(asked.fetch_add(1, Ordering::SeqCst) + 1) };
            shared.get("a", freshness, ask).await.expect("an answer")
        };
        assert_eq!(get(Freshness::lately(0)).await, 1);
        for _ in 0..100 {
            assert_eq!(get(Freshness::lately(0)).await, 1);
        }
        assert_eq!(get(Freshness::now(0)).await, 2, "not older than the question");
        assert_eq!(get(Freshness::lately(0)).await, 2);
        assert_eq!(get(Freshness::lately(1)).await, 3, "this process changed something");
        assert_eq!(get(Freshness::lately(1)).await, 3);
        let later = Freshness { came: Instant::now() + LATELY, ..Freshness::lately(1) };
        assert_eq!(get(later).await, 4, "others may have changed something");
    }

    #[tokio::test]
    async fn an_answer_that_holds_is_given_again_and_an_error_is_not_kept() {
        let shared = Shared::default();
        assert_eq!(
            shared.get("a", Freshness::now(0), |before: Option<i32>| async move { Err::<i32, _>(before) }).await,
            Err(None)
        );
        assert_eq!(
            shared
                .get("a", Freshness::now(0), |before| async move { Ok::<_, ()>(before.map_or(7, |b: i32| b + 1)) })
                .await,
            Ok(7)
        );
        assert_eq!(
            shared.get("b", Freshness::now(0), |before| async move { Ok::<_, ()>(before.unwrap_or(0)) }).await,
            Ok(0)
        );
        assert_eq!(
            shared.get("a", Freshness::now(0), |before| async move { Ok::<_, ()>(before.map_or(7, |b| b + 1)) }).await,
            Ok(8)
        );
    }

    #[tokio::test]
    async fn what_nobody_asks_for_is_let_go() {
        let shared = Shared::default();
        for number in 0..3 * MOST {
            shared
                .get(&number.to_string(), Freshness::now(0), |_| async move { Ok::<_, ()>(number) })
                .await
                .expect("an answer");
        }
        assert!(shared.kept.lock().unwrap().len() <= MOST);
    }
}
