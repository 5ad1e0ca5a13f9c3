//! Which parts of what hangs together can be no buildings by themselves, and what they are joined to.

use crate::partition::Region;
use crate::party_walls::{Border, Borders, SMALLEST};
use gable_geometry::DisjointSets;
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BinaryHeap};

/// Roofs belong together if they meet along at least this share of their common border.
const MEETS: f64 = 0.4;

/// What meets along less than this, against the square root of the smaller roof's area, is joined by a neck: by a crown
/// between two houses, or by an archway.
const NECK: f64 = 0.5;

/// A house is bounded by open air along at least this share of its outline.
const OUTSIDE: f64 = 0.1;

/// The longest party wall, against the square root of the smaller house's area: a house is at most five times as deep
/// as it is wide.
const LONGEST: f64 = 2.3;

/// A part of what hangs together, metres and m².
#[derive(Clone, Copy, Default)]
struct Part {
    area: f64,
    outside: f64,
    inside: f64,
}

impl Part {
    fn can_be_a_building(&self) -> bool {
        self.area >= SMALLEST && self.outside >= OUTSIDE * (self.outside + self.inside)
    }
}

/// How much something asks for two parts to be joined; the queue gives the most, of equals the pair with the smaller
/// numbers.
#[derive(Clone, Copy, PartialEq)]
struct Claim {
    measure: f64,
    pair: (Region, Region),
}

impl Eq for Claim {}

impl Ord for Claim {
    fn cmp(&self, other: &Self) -> Ordering {
        self.measure.total_cmp(&other.measure).then_with(|| other.pair.cmp(&self.pair))
    }
}

impl PartialOrd for Claim {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The parts that have been joined so far, each known by the smallest of its regions.
///
/// Claims wait in queues. A claim never grows but where a border grows, and then a new one is made; so what a queue holds is
/// never too small, and a claim that is out of date is put right when its turn comes.
pub(crate) struct Parts {
    sets: DisjointSets,
    parts: Vec<Part>,
    /// The borders of each part, by the part beyond.
    around: Vec<BTreeMap<Region, Border>>,
    /// Pairs by how much of the smaller one's width the roofs meet along.
    meeting: BinaryHeap<Claim>,
    /// Pairs by how long their border is against the smaller one's width.
    longest: BinaryHeap<Claim>,
    /// Parts that can be no building, the smallest first: the bits of its area, for areas are not negative, and the part.
    annexes: BinaryHeap<Reverse<(u64, Region)>>,
}

impl Parts {
    pub(crate) fn of(borders: &Borders, areas: &[f64]) -> Self {
        let count = areas.len();
        let part = |r: Region| Part { area: areas[r], outside: borders.outside[r], inside: 0.0 };
        let mut out = Self {
            sets: DisjointSets::new(count),
            parts: (0..count).map(part).collect(),
            around: vec![BTreeMap::new(); count],
            meeting: BinaryHeap::new(),
            longest: BinaryHeap::new(),
            annexes: BinaryHeap::new(),
        };
        for (&(a, b), &border) in &borders.between {
            for (own, other) in [(a, b), (b, a)] {
                out.around[own].insert(other, border);
                out.parts[own].inside += border.length;
            }
        }
        for &pair in borders.between.keys() {
            out.claim(pair);
        }
        for part in 0..count {
            out.claim_annexe(part);
        }
        out
    }

    /// The regions of each part, in the order of their smallest.
    pub(crate) fn into_sets(self) -> Vec<Vec<Region>> {
        self.sets.sets()
    }

    /// Puts a pair into the queues.
    fn claim(&mut self, pair: (Region, Region)) {
        let claims = [self.meeting(pair), self.length(pair)];
        if claims[0] >= NECK {
            self.meeting.push(Claim { measure: claims[0], pair });
        }
        if claims[1] > LONGEST {
            self.longest.push(Claim { measure: claims[1], pair });
        }
    }

    fn claim_annexe(&mut self, part: Region) {
        if !self.around[part].is_empty() && !self.parts[part].can_be_a_building() {
            self.annexes.push(Reverse((self.parts[part].area.max(0.0).to_bits(), part)));
        }
    }

    /// Root of the smaller one's area.
    fn width(&self, (a, b): (Region, Region)) -> f64 {
        self.parts[a].area.min(self.parts[b].area).sqrt()
    }

    /// Along how much of its width a pair's roofs meet.
    fn meeting(&self, pair: (Region, Region)) -> f64 {
        let border = self.around[pair.0][&pair.1];
        if border.meeting >= MEETS * border.length { border.meeting / self.width(pair) } else { 0.0 }
    }

    /// Length of a pair's border against its width.
    fn length(&self, pair: (Region, Region)) -> f64 {
        self.around[pair.0][&pair.1].length / self.width(pair)
    }

    /// The two parts that most need to be joined; `None` if each can be a building. First come those whose roofs meet
    /// along most of their width, then the smallest part that can be no building with the neighbour along most of its
    /// border, then the border that is longest for a party wall.
    pub(crate) fn that_belong(&mut self) -> Option<(Region, Region)> {
        if let Some(claim) = self.first(|parts| &mut parts.meeting, Self::meeting).filter(|c| c.measure >= NECK) {
            return Some(claim.pair);
        }
        while let Some(&Reverse((area, annexe))) = self.annexes.peek() {
            let is_current = self.sets.find(annexe) == annexe
                && self.parts[annexe].area.max(0.0).to_bits() == area
                && !self.around[annexe].is_empty()
                && !self.parts[annexe].can_be_a_building();
            if is_current {
                let pair = |other: Region| (annexe.min(other), annexe.max(other));
                let own = self.around[annexe].iter().map(|(&other, border)| (border.length, pair(other)));
                return own.max_by(|s, t| s.0.total_cmp(&t.0).then(t.1.cmp(&s.1))).map(|(_, pair)| pair);
            }
            self.annexes.pop();
        }
        self.first(|parts| &mut parts.longest, Self::length).filter(|c| c.measure > LONGEST).map(|c| c.pair)
    }

    /// The largest claim of a queue, by a measure that never exceeds what the queue says.
    fn first(
        &mut self,
        queue: fn(&mut Self) -> &mut BinaryHeap<Claim>,
        measure: fn(&Self, (Region, Region)) -> f64,
    ) -> Option<Claim> {
        loop {
            let claim = *queue(self).peek()?;
            let (a, b) = claim.pair;
            if !self.around[a].contains_key(&b) {
                queue(self).pop();
                continue;
            }
            let now = measure(self, claim.pair);
            if now == claim.measure {
                return Some(claim);
            }
            queue(self).pop();
            // What grew was put in again; this one comes later than it said.
            if now < claim.measure && now > 0.0 {
                queue(self).push(Claim { measure: now, ..claim });
            }
        }
    }

    /// Joins two parts.
    pub(crate) fn join(&mut self, a: Region, b: Region) {
        self.sets.join(a, b);
        let (stays, goes) = (a.min(b), a.max(b));
        let between = self.around[stays].remove(&goes).unwrap_or_default();
        let gone = std::mem::take(&mut self.around[goes]);
        let other = self.parts[goes];
        let part = &mut self.parts[stays];
        part.area += other.area;
        part.outside += other.outside;
        part.inside += other.inside - 2.0 * between.length;
        for (beyond, border) in gone {
            if beyond == stays {
                continue;
            }
            self.around[beyond].remove(&goes);
            let sum = self.around[stays].entry(beyond).or_default();
            sum.length += border.length;
            sum.meeting += border.meeting;
            let sum = *sum;
            self.around[beyond].insert(stays, sum);
            self.claim((stays.min(beyond), stays.max(beyond)));
        }
        self.claim_annexe(stays);
    }
}
