//! Roof parts that are below LOD2: dormers, chimneys, lift heads, light wells.
//!
//! CityGML 2.0 (§6.1, table of levels) sets the generalisation of LOD2 at parts of about 4 m × 4 m, but real LOD2 models
//! have dormers and lift heads well below that, and so have meshes: a row of dormers comes out as a row. Below 2 m × 2 m,
//! photogrammetry gives a part half of its pixels by chance, and whether a random box or nothing stands in the model
//! would be luck. So they go, all of them, before any line is drawn: what is small, enclosed by the roof, and set off
//! from it by steps. What is small and tall is a tower.

use crate::surface::NONE;
use gable_geometry::{DisjointSets, Plane};
use gable_raster::{Connectivity, Raster, components_where, sides};
use std::collections::BTreeMap;

/// What counts as a superstructure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Superstructures are smaller than this, m².
    pub(crate) area: f64,
    /// Whatever is smaller than this is noise of the labelling, m².
    pub(crate) speck: f64,
    /// A step is a difference of height of at least this, metres.
    pub(crate) step: f64,
}

/// Least share of a superstructure's border that lies on the roof and not at the outline.
const ENCLOSED: f64 = 0.6;

/// Least share of that border along which it is set off by a step.
const SET_OFF: f64 = 0.4;

/// What rises higher over the roof is no superstructure but a tower or a chimney stack, metres on the mean of its steps.
pub(crate) const TALL: f64 = 5.0;

/// The common border of two parts.
#[derive(Clone, Copy, Debug, Default)]
struct Border {
    /// Pixel edges, and those of them along which there is a step.
    edges: usize,
    steps: usize,
    /// Sum of how far the first part rises over the second one along the steps, metres.
    rise: f64,
}

impl std::ops::AddAssign for Border {
    fn add_assign(&mut self, other: Self) {
        self.edges += other.edges;
        self.steps += other.steps;
        self.rise += other.rise;
    }
}

/// One connected set of pixels of one plane.
struct Part {
    label: u16,
    pixels: Vec<usize>,
    /// Pixel edges at the outline.
    outer: usize,
    /// Borders by neighbouring part.
    inner: BTreeMap<usize, Border>,
}

/// Gives specks and superstructures of a pixel labelling to the part of the roof with the longest common border, the
/// smallest first, until none is left. Small parts that meet without a step, as the two halves of a gabled dormer or
/// the facets of a round tower, are judged as one. Works in passes, in which no part takes part twice but a roof that takes in
/// what stands on it; O(pixels) for each.
pub(crate) fn remove(surface: &mut Raster<u16>, planes: &[Plane], limits: Limits) {
    let pixel_area = surface.window().step.powi(2);
    loop {
        let parts = parts(surface, planes, limits.step);
        let area = |part: &Part| part.pixels.len() as f64 * pixel_area;
        let mut candidates: Vec<Candidate> = (0..parts.len())
            .filter(|&k| area(&parts[k]) < limits.speck)
            .map(|k| Candidate::of(vec![k], &parts))
            .chain(
                clusters(&parts, |part| area(part) < limits.area)
                    .into_iter()
                    .map(|members| Candidate::of(members, &parts)),
            )
            .filter(|c| {
                c.heir.is_some()
                    && (c.pixels as f64 * pixel_area < limits.speck || c.is_superstructure(limits.area / pixel_area))
            })
            .collect();
        candidates.sort_by_key(|c| (c.pixels, c.members[0]));
        // What can never be a candidate may take in several at once: it is the same roof before and after.
        let is_roof = |k: usize| area(&parts[k]) >= limits.area.max(limits.speck);
        let mut busy = vec![false; parts.len()];
        // Parts beside a candidate that came before them: what becomes of it may matter to them.
        let mut unsettled = vec![false; parts.len()];
        let mut changed = false;
        for c in candidates {
            let heir = c.heir.filter(|&heir| {
                let settled = is_roof(heir) && c.members.iter().all(|&m| !unsettled[m]);
                (!busy[heir] || settled) && c.members.iter().all(|&m| !busy[m])
            });
            for &beside in c.members.iter().flat_map(|&m| parts[m].inner.keys()) {
                unsettled[beside] = true;
            }
            let Some(heir) = heir else { continue };
            busy[heir] = true;
            changed = true;
            for &m in &c.members {
                busy[m] = true;
                parts[m].pixels.iter().for_each(|&p| surface.values_mut()[p] = parts[heir].label);
            }
        }
        if !changed {
            return;
        }
    }
}

/// Small parts that meet in creases, joined.
fn clusters(parts: &[Part], small: impl Fn(&Part) -> bool) -> Vec<Vec<usize>> {
    let mut sets = DisjointSets::new(parts.len());
    for (k, part) in parts.iter().enumerate() {
        for (&n, border) in &part.inner {
            if 2 * border.steps < border.edges && small(part) && small(&parts[n]) {
                sets.join(k, n);
            }
        }
    }
    let mut out = sets.sets();
    out.retain(|members| small(&parts[members[0]]));
    out
}

/// Parts that may go together.
struct Candidate {
    /// Ascending.
    members: Vec<usize>,
    pixels: usize,
    /// Pixel edges at the outline.
    outer: usize,
    /// The border on the roof.
    roof: Border,
    /// The other part with the longest common border, the first of equals.
    heir: Option<usize>,
}

impl Candidate {
    fn of(members: Vec<usize>, parts: &[Part]) -> Self {
        let mut shared: BTreeMap<usize, Border> = BTreeMap::new();
        let (mut pixels, mut outer) = (0, 0);
        for part in members.iter().map(|&m| &parts[m]) {
            pixels += part.pixels.len();
            outer += part.outer;
            for (&n, &border) in part.inner.iter().filter(|(n, _)| members.binary_search(n).is_err()) {
                *shared.entry(n).or_default() += border;
            }
        }
        let mut roof = Border::default();
        shared.values().for_each(|&border| roof += border);
        let heir = shared.iter().rev().max_by_key(|(_, border)| border.edges).map(|(&heir, _)| heir);
        Self { members, pixels, outer, roof, heir }
    }

    fn is_superstructure(&self, most_pixels: f64) -> bool {
        let Border { edges, steps, rise } = self.roof;
        (self.pixels as f64) < most_pixels
            && edges as f64 >= ENCLOSED * (edges + self.outer) as f64
            && steps as f64 >= SET_OFF * edges as f64
            && rise <= TALL * steps as f64
    }
}

/// The 4-connected parts of a labelling in the order of their first pixels.
fn parts(surface: &Raster<u16>, planes: &[Plane], step: f64) -> Vec<Part> {
    let window = surface.window();
    let (w, h) = (window.width, window.height);
    let labels = surface.values();
    let same = |p: usize, q: usize| labels[p] == labels[q];
    let found = components_where(window, Connectivity::Four, |p| labels[p] != NONE, same);
    let owner = |p: usize| found.numbers.values()[p] as usize - 1;
    let part = |pixels: Vec<usize>| Part { label: labels[pixels[0]], pixels, outer: 0, inner: BTreeMap::new() };
    let mut parts: Vec<Part> = found.members().into_iter().map(part).collect();
    for p in (0..w * h).filter(|&p| labels[p] != NONE) {
        let at = window.centre(p % w, p / w);
        for q in sides(p, w, h) {
            let part = &mut parts[owner(p)];
            match q.filter(|&q| labels[q] != NONE) {
                None => part.outer += 1,
                Some(q) if owner(q) != owner(p) => {
                    let apart = planes[labels[p] as usize].height(at) - planes[labels[q] as usize].height(at);
                    let (steps, rise) = if apart.abs() >= step { (1, apart) } else { (0, 0.0) };
                    *part.inner.entry(owner(q)).or_default() += Border { edges: 1, steps, rise };
                }
                Some(_) => {}
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    const LIMITS: Limits = Limits { area: 10.0, speck: 1.0, step: 0.5 };

    /// A roof of 12 × 12 m that rises to the north, with plane 1 on a rectangle (columns, rows) in pixels of 0.2 m.
    fn roof(columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Raster<u16> {
        let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 62, height: 62 };
        let label = |x: usize, y: usize| match (x, y) {
            _ if x == 0 || y == 0 || x == 61 || y == 61 => NONE,
            _ if columns.contains(&x) && rows.contains(&y) => 1,
            _ => 0,
        };
        Raster::new(window, (0..62 * 62).map(|p| label(p % 62, p / 62)).collect())
    }

    fn left(mut surface: Raster<u16>, other: Plane) -> usize {
        remove(&mut surface, &[Plane { a: 0.0, b: 0.6, c: 5.0 }, other], LIMITS);
        surface.values().iter().filter(|&&l| l == 1).count()
    }

    #[test]
    fn dormers_go_and_small_hips_stay() {
        // A dormer of 2 × 3 m with a level roof stands above the slope by up to 1.8 m.
        let level = Plane::horizontal(5.0 + 0.6 * 5.0);
        assert_eq!(left(roof(20..30, 10..25), level), 0);
        // The same size without a step, as the small hip of a half-hipped roof.
        let meets = Plane { a: 0.0, b: 0.55, c: 5.15 };
        assert_eq!(left(roof(20..30, 10..25), meets), 150);
        // 4 × 4 m is a part of the building.
        assert_eq!(left(roof(20..40, 10..30), Plane::horizontal(10.0)), 400);
        // A chimney stack of 2 × 3 m goes if it is low only.
        assert_eq!(left(roof(20..30, 10..25), Plane::horizontal(11.0)), 0);
        assert_eq!(left(roof(20..30, 10..25), Plane::horizontal(20.0)), 150);
        // A tower in the corner and a porch before the wall stand on walls of their own.
        assert_eq!(left(roof(1..11, 1..11), Plane::horizontal(12.0)), 100);
        let mut porch = roof(0..0, 0..0);
        for y in 1..62 {
            for x in 1..62 {
                if y < 12 && !(20..30).contains(&x) {
                    porch[(x, y)] = NONE;
                } else if y < 12 {
                    porch[(x, y)] = 1;
                }
            }
        }
        assert_eq!(left(porch, Plane::horizontal(3.0)), 110);
    }

    #[test]
    fn facets_that_meet_are_judged_together() {
        // A gabled dormer of 2 × 4 m, and a tower of 4 × 6 m whose halves are each smaller than the limit.
        for (columns, rows, stays) in [(20..30, 10..30, 0), (20..40, 10..34, 480)] {
            let mut surface = roof(columns.clone(), rows.clone());
            let middle = (columns.start + columns.end) / 2;
            for y in rows {
                for x in middle..columns.end {
                    surface[(x, y)] = 2;
                }
            }
            let ridge = surface.window().centre(middle, 0).x - 0.1;
            let half = |a: f64| Plane { a, b: 0.0, c: 11.0 - a * ridge };
            let planes = [Plane { a: 0.0, b: 0.6, c: 5.0 }, half(0.5), half(-0.5)];
            remove(&mut surface, &planes, Limits { area: 16.0, ..LIMITS });
            assert_eq!(surface.values().iter().filter(|&&l| l == 1 || l == 2).count(), stays);
        }
    }

    #[test]
    fn specks_go_whatever_their_plane() {
        assert_eq!(left(roof(20..24, 10..14), Plane { a: 0.0, b: 0.6, c: 5.1 }), 0);
    }
}
