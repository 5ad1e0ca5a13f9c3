//! A growing table that never moves what it holds.

const PAGE: usize = 1 << 16;

/// A vector in pages of 65,536 items.
///
/// A plain vector of 46 million vertices needs three times its size for the moment in which it
/// doubles; this one never needs more than one page beyond what it holds.
#[derive(Debug)]
pub(crate) struct Paged<T> {
    pages: Vec<Vec<T>>,
    len: usize,
}

impl<T> Default for Paged<T> {
    fn default() -> Self {
        Self { pages: Vec::new(), len: 0 }
    }
}

impl<T: Copy> Paged<T> {
    /// Items.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Adds an item.
    pub(crate) fn push(&mut self, item: T) {
        if self.len.is_multiple_of(PAGE) {
            // The first page grows from nothing, so that a small file stays small.
            self.pages.push(Vec::with_capacity(if self.len == 0 { 0 } else { PAGE }));
        }
        if let Some(page) = self.pages.last_mut() {
            page.push(item);
        }
        self.len += 1;
    }

    /// The item at an index.
    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        self.pages.get(index / PAGE)?.get(index % PAGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_what_was_pushed() {
        let mut paged = Paged::default();
        for i in 0..3 * PAGE + 5 {
            paged.push(i);
        }
        assert_eq!(paged.len(), 3 * PAGE + 5);
        assert!((0..paged.len()).all(|i| paged.get(i) == Some(&i)));
        assert_eq!(paged.get(paged.len()), None);
    }
}
