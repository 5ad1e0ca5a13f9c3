//! Disjoint sets of numbers (union–find).

/// The numbers from 0 to n in disjoint sets, at first each in its own. The smallest member stands for its set, so that
/// results do not depend on the order in which sets were joined. Path halving: O(log n) for each call, amortised.
#[derive(Clone, Debug)]
pub struct DisjointSets(Vec<usize>);

impl DisjointSets {
    /// `n` sets of one number each.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    /// Adds a number, the next one, in a set of its own.
    pub fn add(&mut self) -> usize {
        self.0.push(self.0.len());
        self.0.len() - 1
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is no number.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The smallest member of the set that holds `i`.
    pub fn find(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    /// Joins the sets that hold `a` and `b`. Says whether they were two.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }

    /// The sets in the order of their smallest members, each ascending.
    #[must_use]
    pub fn sets(mut self) -> Vec<Vec<usize>> {
        let mut out = vec![Vec::new(); self.0.len()];
        for i in 0..self.0.len() {
            out[self.find(i)].push(i);
        }
        out.retain(|set| !set.is_empty());
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_member_stands_for_its_set() {
        let mut sets = DisjointSets::new(6);
        assert!(sets.join(5, 3) && sets.join(4, 1) && sets.join(3, 4));
        assert!(!sets.join(1, 5));
        assert_eq!([0, 1, 2, 3, 4, 5].map(|i| sets.find(i)), [0, 1, 2, 1, 1, 1]);
        let added = sets.add();
        assert_eq!((added, sets.len()), (6, 7));
        assert_eq!(sets.sets(), [vec![0], vec![1, 3, 4, 5], vec![2], vec![6]]);
    }
}
