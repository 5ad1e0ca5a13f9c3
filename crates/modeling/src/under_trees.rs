//! The part of a building that crowns hide from above.
//!
//! A crown that hangs over a roof bites a round piece out of the building's mask. The walls on both sides of the bite are
//! seen, and they go on under the leaves as they came: to the corner where they meet, to each other, or, where the end of a wing is
//! hidden, to a square end.

use crate::fill::pixels_inside;
use crate::input::BuildingInput;
use gable_geometry::{Box2, DVec2, Polygon, symmetric_eigen_2};
use gable_lines::{LineSegment, Source, snap_directions, trace_outline};
use gable_raster::{GridWindow, Raster};

/// A bite shorter than this along the outline is noise of the labels, metres; so is a glimpse of the outline between leaves.
const SHORTEST_RUN: f64 = 1.0;

/// Leaves are looked for on so many pixels beside the outline.
const BESIDE: i32 = 3;

/// Leaves stand lower than a roof if they do so by this, metres,
const BELOW_ROOF: f32 = 0.5;

/// against the roof so many pixels inside the outline.
const INSIDE: i32 = 2;

/// Beside leaves the outline is rounded and decides nothing, metres.
const ROUNDED: f64 = 0.6;

/// How many times as far beyond leaves a wall along a facade direction is looked for.
const TRIES: u32 = 5;

/// Least length of a wall that may go on under leaves, metres.
const WALL: f64 = 2.0;

/// Largest rms distance of the outline to such a wall, metres.
const STRAIGHT: f64 = 0.15;

/// Where the outline leaves the line of a wall by this, the wall has ended, metres.
const CORNER_OFF: f64 = 0.35;

/// Longest piece of the outline that may be seen between leaves without showing a wall, metres.
const GLIMPSE: f64 = 4.0;

/// How far apart two walls may be to be one behind leaves, metres.
const SAME_WALL: f64 = 0.6;

/// Up to this, metres, one of two parallel walls goes on behind leaves to a jog: the inner one, for nobody knows where the jog is.
const JOG: f64 = 3.0;

/// Least sine of the angle in which walls make a corner (45°), and the largest for one wall (10°).
const CORNER: f64 = 0.7;
const PARALLEL: f64 = 0.17;

/// How far a wall may go on behind leaves, metres: the width of a large crown.
const CROWN: f64 = 14.0;

/// How far beyond the mask a building may be completed, metres: as far as a crown reaches, with the pixels around it that are
/// looked at.
pub(crate) const REACH: f64 = CROWN + 1.0;

/// A crown beside a wall bites as deep as half of the width of its bite at most; what is deeper is a yard with a tree in it. The
/// second figure is what leaves add to that, metres.
const DEEPEST: (f64, f64) = (0.5, 1.0);

/// A crown over a corner reaches as far from it as along the walls, about; what is deeper is the inside of an L.
const CORNER_DEEPEST: f64 = 1.2;

/// Share of what is added that must lie under leaves.
const LEAVES: f64 = 0.9;

/// Largest share of the mask that may be added.
const SHARE: f64 = 0.3;

/// Walls within this angle of a facade direction turn to it, radians (8°).
const SNAP: f64 = 0.14;

/// The building with what crowns hide of it: the mask is completed, and has no height there, so that the roof's planes go on
/// over it. `None` if nothing is added. `frames` are the facade directions.
///
/// A wall goes on only under leaves, and not far. All leaves beside the outline may hide it, or only the high ones: both are
/// tried, for a round crown hangs lower than the roof at its rim, and a hedge would hide a wall that is seen. Where a crown hides
/// both corners of a wing, the wing goes on as far as anything of its end is seen. O(pixels).
pub(crate) fn complete(input: &BuildingInput, frames: &[f64]) -> Option<BuildingInput> {
    let mut out = input.clone();
    let most = SHARE * input.mask.values().iter().filter(|&&m| m).count() as f64;
    let mut added = false;
    for ring in trace_outline(&input.mask) {
        for leaves in [Leaves::All, Leaves::High] {
            let contour = Contour::new(&ring.points, input, leaves);
            for bite in contour.runs(true).into_iter().filter_map(|run| contour.bite(run, frames)) {
                let pixels = pixels_in(&bite, &input.mask);
                let leaves = pixels.iter().filter(|&&p| input.crowns.values()[p]).count() as f64;
                let count = pixels.len() as f64;
                if count > 0.0 && count <= most && leaves >= LEAVES * count {
                    added = true;
                    for p in pixels {
                        out.mask.values_mut()[p] = true;
                        out.height.values_mut()[p] = f32::NAN;
                    }
                }
            }
        }
    }
    added.then_some(out)
}

/// Pixels inside a ring that are not in the mask.
fn pixels_in(ring: &[DVec2], mask: &Raster<bool>) -> Vec<usize> {
    let window = mask.window();
    let area = GridWindow::covering(Box2::of(ring.iter().copied()), window.step).intersection(&window);
    let mut out = Vec::new();
    let polygon = Polygon { outer: ring.to_vec(), holes: Vec::new() };
    pixels_inside(&polygon, area, |x, y| {
        if let Some((x, y)) = window.pixel(area.centre(x, y)).filter(|&pixel| !mask[pixel]) {
            out.push(y * window.width + x);
        }
    });
    out
}

/// Which leaves beside an outline hide it.
#[derive(Clone, Copy)]
enum Leaves {
    /// All: the rim of a round crown hangs lower than the roof.
    All,
    /// Those as high as the roof: a hedge hides nothing from above.
    High,
}

/// A boundary of the mask, which lies to its left.
struct Contour {
    points: Vec<DVec2>,
    /// Whether leaves lie beside the crack that leaves each point.
    hidden: Vec<bool>,
    step: f64,
}

/// A piece of the contour: number of its first crack, and of cracks.
type Run = (usize, usize);

/// A piece of the contour that leaves hide, with the walls before and behind it.
struct Hidden {
    run: Run,
    a: LineSegment,
    b: LineSegment,
}

impl Contour {
    fn new(points: &[DVec2], input: &BuildingInput, which: Leaves) -> Self {
        let (n, window) = (points.len(), input.window());
        let step = window.step;
        let hidden: Vec<bool> = (0..n)
            .map(|i| {
                let (p, q) = (points[i], points[(i + 1) % n]);
                let outwards = -(q - p).perp().normalize_or_zero() * step;
                let beside = |k: i32| window.pixel(0.5 * (p + q) + (f64::from(k) - 0.5) * outwards);
                let hides = |pixel: &(usize, usize)| input.crowns[*pixel];
                let roof = beside(-INSIDE).map_or(f32::NAN, |pixel| input.height[pixel]);
                let low = |pixel: &(usize, usize)| input.height[*pixel] < roof - BELOW_ROOF;
                // A pixel of another label may lie between.
                let mut near = (1..=BESIDE).filter_map(beside).filter(hides);
                match which {
                    Leaves::All => near.next().is_some(),
                    Leaves::High => near.any(|pixel| !low(&pixel)),
                }
            })
            .collect();
        let mut contour = Self { points: points.to_vec(), hidden, step };
        contour.fill_short(true);
        contour.fill_short(false);
        contour
    }

    /// Runs of cracks that are all hidden or all seen; none if the contour does not change.
    fn runs(&self, hidden: bool) -> Vec<Run> {
        let n = self.hidden.len();
        let starts = (0..n).filter(|&i| self.hidden[i] == hidden && self.hidden[(i + n - 1) % n] != hidden);
        starts.map(|i| (i, (0..n).take_while(|k| self.hidden[(i + k) % n] == hidden).count())).collect()
    }

    /// Gives runs of the other kind that are too short to mean anything to this kind.
    fn fill_short(&mut self, hidden: bool) {
        let n = self.hidden.len();
        for (first, count) in self.runs(!hidden) {
            if (count as f64) * self.step < SHORTEST_RUN {
                (first..first + count).for_each(|i| self.hidden[i % n] = hidden);
            }
        }
    }

    /// The ring of what a hidden run hides, counter-clockwise.
    fn bite(&self, run: Run, frames: &[f64]) -> Option<Vec<DVec2>> {
        let n = self.points.len();
        let Hidden { run: (first, count), a, b } = self.between_walls(run, frames)?;
        let last = first + count;
        let (from, to) = (a.direction(), b.direction());
        // Both walls, up to the leaves.
        let foot =
            |wall: &LineSegment, p: DVec2| wall.middle() + wall.direction() * wall.direction().dot(p - wall.middle());
        let (end, start) = (foot(&a, self.points[first]), foot(&b, self.points[last % n]));
        let turn = from.perp_dot(to);
        let hidden = |k: usize| self.points[(first + k) % n];
        let mut ring = vec![end];
        if turn >= CORNER {
            let along = (start - end).perp_dot(to) / turn;
            let corner = end + along * from;
            let back = (start - corner).dot(to);
            let deepest = (0..=count).map(|k| hidden(k).distance(corner)).fold(0.0, f64::max);
            let longest = along.max(back);
            if longest > CROWN || along.min(back) < -ROUNDED || deepest > CORNER_DEEPEST * longest + ROUNDED {
                return None;
            }
            ring.push(corner);
        } else if turn.abs() <= PARALLEL && from.dot(to) > 0.0 {
            let gap = (start - end).dot(from);
            let inwards = from.perp_dot(start - end);
            if gap <= 0.0 || gap > CROWN.min(a.length() + b.length()) || inwards.abs() > JOG {
                return None;
            }
            // Where the inner one of both ends, if they are not one.
            if inwards > SAME_WALL {
                ring.push(foot(&b, end));
            } else if inwards < -SAME_WALL {
                ring.push(foot(&a, start));
            }
            let inner = if inwards > 0.0 { start } else { end };
            let deepest = (0..=count).map(|k| from.perp_dot(hidden(k) - inner)).fold(0.0, f64::max);
            if deepest > DEEPEST.0 * gap + DEEPEST.1 {
                return None;
            }
        } else if turn.abs() <= PARALLEL && from.perp_dot(start - end) > 0.0 {
            // The end of a wing, with both corners hidden: square, and as far out as anything of it is seen.
            if start.distance(end) > CROWN {
                return None;
            }
            let reach = |p: DVec2| from.dot(p - end);
            let furthest = (0..=count).map(|k| reach(hidden(k))).fold(reach(start).max(0.0), f64::max);
            ring.push(end + from * furthest);
            ring.push(start + from * (furthest - reach(start)));
        } else {
            return None;
        }
        ring.push(start);
        ring.extend((0..=count).rev().map(hidden));
        Some(ring)
    }

    /// A hidden run with the walls at both ends. What is seen between leaves and shows no wall is taken into it, with the leaves
    /// beyond.
    fn between_walls(&self, (mut first, mut count): Run, frames: &[f64]) -> Option<Hidden> {
        let n = self.points.len();
        let a = loop {
            if let Some(wall) = self.wall(first, false, frames) {
                break wall;
            }
            let more = self.to_next_leaves(first, false)?;
            (first, count) = ((first + n - more) % n, count + more);
            if count >= n {
                return None;
            }
        };
        let b = loop {
            let last = (first + count) % n;
            if let Some(wall) = self.wall(last, true, frames) {
                break wall;
            }
            count += self.to_next_leaves(last, true)?;
            if count >= n {
                return None;
            }
        };
        Some(Hidden { run: (first, count), a, b })
    }

    /// From the end of a hidden run, cracks to the far end of the next one, if only a glimpse of the outline lies between them.
    fn to_next_leaves(&self, at: usize, forwards: bool) -> Option<usize> {
        let n = self.points.len();
        let seen = (0..n).take_while(|&k| !self.hidden[self.crack(at, k, forwards)]).count();
        let hidden = (seen..n).take_while(|&k| self.hidden[self.crack(at, k, forwards)]).count();
        (seen as f64 * self.step <= GLIMPSE).then_some(seen + hidden)
    }

    /// The crack that lies `k` cracks from a point, forwards or back.
    fn crack(&self, at: usize, k: usize, forwards: bool) -> usize {
        let n = self.points.len();
        if forwards { (at + k) % n } else { (at + n - 1 - k % n) % n }
    }

    /// The wall that ends at a point, or begins there. The side of a web of leaves may be straight too, so the next wall along a
    /// facade direction is preferred to it.
    fn wall(&self, at: usize, forwards: bool, frames: &[f64]) -> Option<LineSegment> {
        let found = (1..=TRIES).filter_map(|k| self.straight(at, forwards, f64::from(k) * ROUNDED));
        let mut first = None;
        for wall in found {
            let mut turned = [wall];
            snap_directions(&mut turned, frames, SNAP);
            if turned[0] != wall {
                return Some(turned[0]);
            }
            first = first.or(Some(wall));
        }
        first
    }

    /// What lies on one line of the seen contour that ends at a point, or begins there, without the next `skipped` metres.
    fn straight(&self, at: usize, forwards: bool, skipped: f64) -> Option<LineSegment> {
        let n = self.points.len();
        let crack = |k: usize| self.crack(at, k, forwards);
        let middle = |k: usize| 0.5 * (self.points[crack(k)] + self.points[(crack(k) + 1) % n]);
        let skipped = (skipped / self.step).round() as usize;
        let seen = (0..n).take_while(|&k| !self.hidden[crack(k)]).count();
        let origin = self.points[at];
        let mut sums = [0.0; 6];
        let mut best = None;
        for k in skipped..seen {
            let d = middle(k) - origin;
            for (sum, v) in sums.iter_mut().zip([1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y]) {
                *sum += v;
            }
            let [count, x, y, xx, xy, yy] = sums;
            let centre = DVec2::new(x, y) / count;
            let spread =
                [xx / count - centre.x * centre.x, xy / count - centre.x * centre.y, yy / count - centre.y * centre.y];
            let ([across, _], [_, along]) = symmetric_eigen_2(spread);
            let reach = middle(k) - middle(skipped);
            let length = reach.dot(along).abs();
            if length >= WALL {
                let off = along.perp_dot(middle(k) - origin - centre).abs();
                if off > CORNER_OFF || across.max(0.0).sqrt() > STRAIGHT {
                    break;
                }
                let along = if (reach.dot(along) > 0.0) == forwards { along } else { -along };
                let half = 0.5 * length * along;
                best = Some(LineSegment {
                    a: origin + centre - half,
                    b: origin + centre + half,
                    weight: length,
                    source: Source::Outline,
                });
            }
        }
        best
    }
}
