//! What covers the ground between given buildings, where no plan of the streets is known.
//!
//! Free space that a large disc fits in is open: lawns, squares, car parks. What else a small disc can reach from outside is
//! street, with footways along the walls, unless there are sheds near, as there are in gardens. The rest is gardens and
//! yards, each of the building that is nearest (its Voronoi cell), so that gardens are parcels.

use super::objects::Cover;
use crate::noise::noise2;
use gable_geometry::{Box2, DVec2, dvec2, ring_area};

/// Pitch of the map, metres.
const STEP: f64 = 0.5;
/// Radius of the disc that tells streets from gardens, metres.
const STREET: f64 = 3.2;
/// Radius of the disc that fits in open places, metres.
const OPEN: f64 = 10.5;
/// Buildings below this area are sheds, m².
const SHED: f64 = 26.0;
/// How far gardens reach around sheds, metres.
const AROUND_SHEDS: f64 = 8.0;
/// Width of footways along walls, metres.
const FOOTWAY: f64 = 1.7;

/// Turns, mirrors and moves plans; a copy of a model lies in a square place.
#[derive(Clone, Copy)]
pub(crate) struct Placement {
    /// Right angles.
    pub(crate) turn: usize,
    pub(crate) mirror: bool,
    pub(crate) shift: DVec2,
}

impl Placement {
    /// From the model, relative to its centre, to the scene.
    pub(crate) fn apply(&self, p: DVec2) -> DVec2 {
        let q = if self.mirror { dvec2(-p.x, p.y) } else { p };
        (0..self.turn).fold(q, |q, _| q.perp()) + self.shift
    }

    fn undo(&self, p: DVec2) -> DVec2 {
        let q = (0..self.turn).fold(p - self.shift, |q, _| dvec2(q.y, -q.x));
        if self.mirror { dvec2(-q.x, q.y) } else { q }
    }
}

/// The map of one model, looked up through the places of its copies.
pub(crate) struct CoverMap {
    seed: u64,
    low: DVec2,
    width: usize,
    height: usize,
    /// Distance to the nearest wall in units of 0.1 m, up to 25.5 m.
    distance: Vec<u8>,
    kind: Vec<Kind>,
    /// A number drawn for the nearest building.
    lot: Vec<u8>,
    /// Side of the place of a copy, metres; infinite where there is one copy.
    side: f64,
    /// Row by row.
    copies: Vec<Placement>,
}

/// Kinds of free space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Street,
    Garden,
    Open,
}

/// What is known of a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ground {
    /// Distance to the nearest wall, up to 25 m.
    pub(crate) distance: f64,
    pub(crate) kind: Kind,
    lot: u8,
}

impl CoverMap {
    /// From plans relative to the centre of the model.
    pub(crate) fn new(plans: &[Vec<DVec2>], seed: u64, side: f64, copies: Vec<Placement>) -> Self {
        let around = Box2::of(plans.iter().flatten().copied()).grown(26.0);
        let size = (around.size() / STEP).ceil();
        let (width, height) = (size.x as usize + 1, size.y as usize + 1);
        let mut built = vec![u32::MAX; width * height];
        for (n, ring) in plans.iter().enumerate() {
            fill(ring, around.min, width, height, |k| built[k] = n as u32);
        }
        let walls = nearest(&built, width, height);
        let metres = |k: usize| f64::from(walls[k].0).sqrt() * STEP;
        let within = |marks: &[u32], reach: f64| -> Vec<bool> {
            nearest(marks, width, height).iter().map(|(d, _)| f64::from(*d).sqrt() * STEP < reach).collect()
        };
        let farther = |than: f64| -> Vec<u32> {
            (0..built.len()).map(|k| if metres(k) >= than { 0 } else { u32::MAX }).collect()
        };
        let street = within(&from_border(&farther(STREET), width, height), STREET + 0.3);
        let open = within(&farther(OPEN), OPEN);
        let small = |n: u32| plans.get(n as usize).is_some_and(|ring| ring_area(ring).abs() < SHED);
        let sheds: Vec<u32> = built.iter().map(|&n| if small(n) { n } else { u32::MAX }).collect();
        let sheds = within(&sheds, AROUND_SHEDS);
        let kind = |k: usize| match (street[k], open[k], sheds[k]) {
            (true, true, _) => Kind::Open,
            (true, false, false) => Kind::Street,
            _ => Kind::Garden,
        };
        Self {
            seed,
            low: around.min,
            width,
            height,
            distance: (0..built.len()).map(|k| (metres(k) * 10.0).min(255.0) as u8).collect(),
            kind: (0..built.len()).map(kind).collect(),
            lot: walls.iter().map(|(_, n)| crate::noise::hash(seed ^ 0x107, i64::from(*n), 0, 0) as u8).collect(),
            side,
            copies,
        }
    }

    /// What is known of a place; `None` far from the model.
    pub(crate) fn ground(&self, p: DVec2) -> Option<Ground> {
        let per_row = if self.side.is_finite() { (self.copies.len() as f64).sqrt().round() as usize } else { 1 };
        let cell =
            |v: f64| if self.side.is_finite() { ((v / self.side).max(0.0) as usize).min(per_row - 1) } else { 0 };
        let q = self.copies[cell(p.y) * per_row + cell(p.x)].undo(p) - self.low;
        let (x, y) = (q.x / STEP - 0.5, q.y / STEP - 0.5);
        if x < 0.0 || y < 0.0 || x >= (self.width - 1) as f64 || y >= (self.height - 1) as f64 {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        let (u, v) = (x.fract(), y.fract());
        let at = |di: usize, dj: usize| f64::from(self.distance[(j + dj) * self.width + i + di]) / 10.0;
        let distance = (at(0, 0) * (1.0 - u) + at(1, 0) * u) * (1.0 - v) + (at(0, 1) * (1.0 - u) + at(1, 1) * u) * v;
        let k = (y.round() as usize) * self.width + x.round() as usize;
        Some(Ground { distance, kind: self.kind[k], lot: self.lot[k] })
    }

    /// The cover of a place.
    pub(crate) fn cover(&self, p: DVec2) -> Cover {
        let Some(ground) = self.ground(p) else { return open(self.seed, p) };
        match ground.kind {
            Kind::Street if ground.distance < FOOTWAY => return Cover::Pavement,
            Kind::Street => return Cover::Asphalt,
            Kind::Open if ground.distance < 0.8 => return Cover::Pavement,
            Kind::Open => return open(self.seed, p),
            Kind::Garden => {}
        }
        // Many have a terrace at the house.
        let paved = ground.lot & 7 < 4 && ground.distance < 1.0 + f64::from(ground.lot >> 6);
        match ground.lot {
            _ if paved => Cover::Yard,
            d if d < 150 => Cover::Grass,
            d if d < 205 => Cover::Yard,
            d if d < 240 => Cover::Pavement,
            _ => Cover::Soil,
        }
    }
}

/// Wide places: mostly lawn, some squares and car parks.
fn open(seed: u64, p: DVec2) -> Cover {
    match noise2(seed ^ 0x0fe, 90.0, p.x, p.y) {
        n if n > -0.2 => Cover::Grass,
        n if n > -0.42 => Cover::Parking,
        _ => Cover::Pavement,
    }
}

/// Calls `f` for each cell with its centre inside a ring (even–odd).
fn fill(ring: &[DVec2], low: DVec2, width: usize, height: usize, mut f: impl FnMut(usize)) {
    let bounds = Box2::of(ring.iter().copied());
    let row = |y: f64| (((y - low.y) / STEP - 0.5).ceil().max(0.0) as usize).min(height);
    for j in row(bounds.min.y)..row(bounds.max.y) {
        let y = low.y + (j as f64 + 0.5) * STEP;
        let mut crossings: Vec<f64> = (0..ring.len())
            .map(|k| (ring[k], ring[(k + 1) % ring.len()]))
            .filter(|(p, q)| (p.y > y) != (q.y > y))
            .map(|(p, q)| p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x))
            .collect();
        crossings.sort_by(f64::total_cmp);
        let column = |x: f64| (((x - low.x) / STEP - 0.5).ceil().max(0.0) as usize).min(width);
        for span in crossings.chunks_exact(2) {
            (column(span[0])..column(span[1])).for_each(|i| f(j * width + i));
        }
    }
}

/// For each cell the squared distance, in cells, to the nearest cell that has a number, and that number: exact, by
/// lower envelopes of parabolas (Felzenszwalb and Huttenlocher 2012). Linear.
fn nearest(marks: &[u32], width: usize, height: usize) -> Vec<(u32, u32)> {
    const FAR: u32 = 1 << 28;
    let mut best: Vec<(u32, u32)> = marks.iter().map(|&m| if m == u32::MAX { (FAR, m) } else { (0, m) }).collect();
    let line = |start: usize, stride: usize, n: usize, best: &mut Vec<(u32, u32)>| {
        let own: Vec<(u32, u32)> = (0..n).map(|k| best[start + k * stride]).collect();
        let mut tops: Vec<(usize, f64)> = Vec::with_capacity(n);
        for (q, mark) in own.iter().enumerate().filter(|(_, m)| m.0 < FAR) {
            let height = |k: usize, d: u32| f64::from(d) + (k * k) as f64;
            let mut from = f64::NEG_INFINITY;
            while let Some(&(p, since)) = tops.last() {
                from = (height(q, mark.0) - height(p, own[p].0)) / (2 * (q - p)) as f64;
                if from > since {
                    break;
                }
                tops.pop();
                from = f64::NEG_INFINITY;
            }
            tops.push((q, from));
        }
        let mut at = 0;
        for k in 0..n {
            while at + 1 < tops.len() && tops[at + 1].1 <= k as f64 {
                at += 1;
            }
            if let Some(&(p, _)) = tops.get(at) {
                let apart = p.abs_diff(k) as u32;
                best[start + k * stride] = (own[p].0 + apart * apart, own[p].1);
            }
        }
    };
    for i in 0..width {
        line(i, width, height, &mut best);
    }
    for j in 0..height {
        line(j * width, 1, width, &mut best);
    }
    best
}

/// Keeps the marks that hang together with the border.
fn from_border(marks: &[u32], width: usize, height: usize) -> Vec<u32> {
    let mut out = vec![u32::MAX; marks.len()];
    let border = (0..width)
        .flat_map(|i| [i, (height - 1) * width + i])
        .chain((0..height).flat_map(|j| [j * width, j * width + width - 1]));
    let mut open: Vec<usize> = border.filter(|&k| marks[k] != u32::MAX).collect();
    while let Some(k) = open.pop() {
        if out[k] != u32::MAX {
            continue;
        }
        out[k] = marks[k];
        let (i, j) = (k % width, k / width);
        let around = [
            (i > 0, k.wrapping_sub(1)),
            (i + 1 < width, k + 1),
            (j > 0, k.wrapping_sub(width)),
            (j + 1 < height, k + width),
        ];
        open.extend(around.iter().filter(|(inside, n)| *inside && marks[*n] != u32::MAX).map(|(_, n)| *n));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<DVec2> {
        vec![dvec2(x0, y0), dvec2(x1, y0), dvec2(x1, y1), dvec2(x0, y1)]
    }

    #[test]
    fn distances_are_those_of_brute_force() {
        let (width, height) = (23, 17);
        let mut random = gable_geometry::Counter::new(5);
        let marks: Vec<u32> =
            (0..width * height).map(|k| if random.unit() < 0.05 { k as u32 } else { u32::MAX }).collect();
        for (k, (found, _)) in nearest(&marks, width, height).into_iter().enumerate() {
            let squared = |n: usize| (n % width).abs_diff(k % width).pow(2) + (n / width).abs_diff(k / width).pow(2);
            let least = (0..marks.len()).filter(|&n| marks[n] != u32::MAX).map(squared).min();
            assert_eq!(Some(found as usize), least);
        }
    }

    /// Four wings of 6 m around a yard of 28 × 28 m, and another house 8 m beside them.
    #[test]
    fn yards_are_gardens_and_gaps_between_houses_are_streets() {
        let plans = [
            rectangle(-20.0, -20.0, 20.0, -14.0),
            rectangle(-20.0, 14.0, 20.0, 20.0),
            rectangle(-20.0, -14.0, -14.0, 14.0),
            rectangle(14.0, -14.0, 20.0, 14.0),
            rectangle(28.0, -20.0, 34.0, 20.0),
        ];
        let still = Placement { turn: 0, mirror: false, shift: dvec2(50.0, 50.0) };
        let turned = Placement { turn: 1, mirror: true, shift: dvec2(150.0, 50.0) };
        let lower = Placement { shift: dvec2(50.0, 150.0), ..still };
        let map = CoverMap::new(&plans, 1, 100.0, vec![still, turned, lower, lower]);
        for copy in [still, turned] {
            let at = |x: f64, y: f64| map.ground(copy.apply(dvec2(x, y))).expect("in the map");
            let inside = at(3.0, 1.0);
            assert!(inside.kind == Kind::Garden && (inside.distance - 11.0).abs() < 0.6, "{inside:?}");
            let between = at(24.0, 3.0);
            assert!(between.kind == Kind::Street && (between.distance - 4.0).abs() < 0.6, "{between:?}");
            assert_eq!(at(-40.0, 3.0).kind, Kind::Open);
            assert_eq!(map.cover(copy.apply(dvec2(24.0, 3.0))), Cover::Asphalt);
            assert_eq!(map.cover(copy.apply(dvec2(21.0, 3.0))), Cover::Pavement);
        }
        let p = dvec2(3.0, 7.0);
        assert!((turned.undo(turned.apply(p)) - p).length() < 1e-12);
    }
}
