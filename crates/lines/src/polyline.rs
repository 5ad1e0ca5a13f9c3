//! A ring of contour points becomes a polygon of few straight segments with sharp corners.

use crate::{LineSegment, Source};
use gable_geometry::{DVec2, symmetric_eigen_2};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Parameters of [`fit_polyline`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolylineParams {
    /// Standard deviation of the contour about a straight wall, metres (default 0.15).
    pub tolerance: f64,
    /// Length over which the contour's deviations hang together, metres (default 1.0): that much contour counts as one
    /// independent observation.
    pub correlation: f64,
    /// Price of one segment, in units of a squared deviation over `tolerance` per `correlation` (default 5).
    pub segment_cost: f64,
    /// Contour this close to a corner is rounded and does not decide where the wall runs, metres (default 0.35).
    pub corner_radius: f64,
}

impl Default for PolylineParams {
    fn default() -> Self {
        Self { tolerance: 0.15, correlation: 1.0, segment_cost: 5.0, corner_radius: 0.35 }
    }
}

/// Fits a closed polygon of few segments to a closed contour.
///
/// 1. The contour is cut into pieces that minimise Σ (∫ d² ds / (tolerance² · correlation) + segment cost), `d` being
///    the distance to the piece's own total-least-squares line: an exact dynamic programme over all cuts of the contour
///    opened at one point, pruned as in PELT (Killick et al. 2012). It is run twice, the second time opened at the
///    sharpest corner of the first.
/// 2. Each piece is fitted again without its rounded ends, by reweighted least squares that ignore outliers.
/// 3. Neighbouring lines are intersected; where they are nearly parallel and apart, a short step joins them; a piece
///    that turned round between its neighbours is dropped.
///
/// The segments form a closed chain, run in the direction of the contour and have their supported length as weight.
/// Curved walls become chains of short segments. Fewer than three points, or a contour that collapses to a line, give
/// an empty chain. Cost: O(n · k) for n points and pieces of about k points.
#[must_use]
pub fn fit_polyline(contour: &[DVec2], params: &PolylineParams) -> Vec<LineSegment> {
    if contour.len() < 3 {
        return Vec::new();
    }
    let mut points = contour.to_vec();
    let cuts = cut(&points, params);
    let start = sharpest(&points, &cuts);
    points.rotate_left(start);
    let cuts = cut(&points, params);
    let mut pieces = Vec::new();
    for (i, &from) in cuts.iter().enumerate() {
        let to = cuts.get(i + 1).copied().unwrap_or(points.len());
        // Pieces share the points at which they are cut.
        let piece: Vec<_> = (from..=to).map(|k| points[k % points.len()]).collect();
        pieces.extend(Piece::fit(&piece, params));
    }
    chain(pieces, params)
}

/// Sums over a contour's prefixes, from which the total-least-squares residual of any piece follows in O(1).
struct Prefix {
    /// Weight and weighted x, y, xx, xy, yy of the steps before each point. A step from point to point counts by its
    /// length, at its middle, so that pieces share points but no weight.
    sums: Vec<[f64; 6]>,
}

impl Prefix {
    fn new(points: &[DVec2]) -> Self {
        let n = points.len();
        let origin = points[0];
        let mut sums = vec![[0.0; 6]];
        let mut sum = [0.0; 6];
        for k in 0..n {
            let (p, q) = (points[k], points[(k + 1) % n]);
            let (w, d) = (p.distance(q), 0.5 * (p + q) - origin);
            for (s, v) in sum.iter_mut().zip([1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y]) {
                *s += w * v;
            }
            sums.push(sum);
        }
        Self { sums }
    }

    /// ∫ d² ds from point `from` to point `to` about the best line.
    #[inline]
    fn residual(&self, from: usize, to: usize) -> f64 {
        let (a, b) = (&self.sums[from], &self.sums[to]);
        let w = b[0] - a[0];
        if w <= 0.0 {
            return 0.0;
        }
        let (x, y) = ((b[1] - a[1]) / w, (b[2] - a[2]) / w);
        let (xx, xy, yy) = ((b[3] - a[3]) / w - x * x, (b[4] - a[4]) / w - x * y, (b[5] - a[5]) / w - y * y);
        let half = 0.5 * (xx - yy);
        ((0.5 * (xx + yy) - (half * half + xy * xy).sqrt()) * w).max(0.0)
    }
}

/// The best cuts of a contour that is opened at point 0: indices of the points where pieces start, 0 first.
fn cut(points: &[DVec2], params: &PolylineParams) -> Vec<usize> {
    let n = points.len();
    let prefix = Prefix::new(points);
    let scale = 1.0 / (params.tolerance * params.tolerance * params.correlation);
    let mut best = vec![0.0; n + 1];
    let mut previous = vec![0; n + 1];
    let mut open: Vec<usize> = Vec::new();
    let mut costs = Vec::new();
    for to in 1..=n {
        open.push(to - 1);
        costs.clear();
        best[to] = f64::INFINITY;
        for &from in &open {
            let cost = best[from] + scale * prefix.residual(from, to);
            costs.push(cost);
            if cost + params.segment_cost < best[to] {
                best[to] = cost + params.segment_cost;
                previous[to] = from;
            }
        }
        // A start that is beaten without its next segment's price stays beaten: cutting a piece never adds residual.
        let bound = best[to];
        let mut costs = costs.iter();
        open.retain(|_| costs.next().is_some_and(|&c| c <= bound));
    }
    let mut cuts = Vec::new();
    let mut at = n;
    while at > 0 {
        at = previous[at];
        cuts.push(at);
    }
    cuts.reverse();
    cuts
}

/// The cut at which the contour turns most between the pieces on either side.
fn sharpest(points: &[DVec2], cuts: &[usize]) -> usize {
    let n = cuts.len();
    if n < 2 {
        // One piece: open it where it is farthest from its first point.
        let far = |i: &usize| points[*i].distance_squared(points[0]);
        return (0..points.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
    }
    let turn = |i: usize| {
        let [a, b, c] = [cuts[(i + n - 1) % n], cuts[i], cuts[(i + 1) % n]].map(|k| points[k]);
        (b - a).normalize_or_zero().dot((c - b).normalize_or_zero())
    };
    // Opening point 0 may itself be no corner: prefer others at equal turn.
    (0..n).rev().min_by(|&a, &b| turn(a).total_cmp(&turn(b))).map_or(0, |i| cuts[i])
}

/// A straight piece of the contour.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// First and last contour point.
    ends: [DVec2; 2],
    /// A point of the line.
    at: DVec2,
    /// Unit direction, along the contour.
    along: DVec2,
    /// Contour length.
    length: f64,
}

impl Piece {
    /// Line through the points between the rounded ends, by least squares with Tukey weights; `None` for one point.
    fn fit(points: &[DVec2], params: &PolylineParams) -> Option<Self> {
        let (&first, &last) = (points.first()?, points.last()?);
        let length: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        // Short pieces keep their middle half.
        let trim = params.corner_radius.min(0.25 * length);
        let mut walked = 0.0;
        let mut kept = Vec::with_capacity(points.len());
        for w in points.windows(2) {
            let ds = w[0].distance(w[1]);
            if walked + 0.5 * ds >= trim && walked + 0.5 * ds <= length - trim {
                kept.push((0.5 * (w[0] + w[1]), ds));
            }
            walked += ds;
        }
        let mut line = total_least_squares(&kept, |_| 1.0).or_else(|| {
            let along = (last - first).try_normalize()?;
            Some((0.5 * (first + last), along))
        })?;
        for _ in 0..4 {
            let (at, along) = line;
            let cut = 2.5 * params.tolerance;
            let weight = |p: DVec2| {
                let r = along.perp_dot(p - at) / cut;
                (1.0 - r * r).max(0.0).powi(2)
            };
            let Some(next) = total_least_squares(&kept, weight) else { break };
            line = next;
        }
        let (at, along) = line;
        let along = if along.dot(last - first) < 0.0 { -along } else { along };
        Some(Self { ends: [first, last], at, along, length })
    }

    fn project(&self, p: DVec2) -> DVec2 {
        self.at + self.along * self.along.dot(p - self.at)
    }
}

/// Centroid and unit direction of the orthogonal least-squares line of weighted points; `None` without a direction.
fn total_least_squares(points: &[(DVec2, f64)], weight: impl Fn(DVec2) -> f64) -> Option<(DVec2, DVec2)> {
    let origin = points.first()?.0;
    let mut sums = [0.0; 6];
    for &(p, w) in points {
        let (w, d) = (w * weight(p), p - origin);
        for (s, v) in sums.iter_mut().zip([1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y]) {
            *s += w * v;
        }
    }
    let [w, x, y, xx, xy, yy] = sums;
    if w <= 0.0 {
        return None;
    }
    let (x, y) = (x / w, y / w);
    let (values, vectors) = symmetric_eigen_2([xx / w - x * x, xy / w - x * y, yy / w - y * y]);
    (values[1] > 1e-12).then(|| (origin + DVec2::new(x, y), vectors[1]))
}

/// How two neighbouring pieces meet.
enum Joint {
    Corner(DVec2),
    /// Ends of the step between two nearly parallel lines.
    Step(DVec2, DVec2),
}

fn joint(before: &Piece, after: &Piece, params: &PolylineParams) -> Joint {
    let cut = before.ends[1];
    let (p, q) = (before.project(cut), after.project(cut));
    let sine = before.along.perp_dot(after.along);
    let cosine = before.along.dot(after.along);
    if sine.abs() > 1e-6 {
        let corner = before.at + before.along * (after.along.perp_dot(before.at - after.at) / sine);
        // Noise moves the intersection of two lines by about tolerance / sin(angle) along them.
        let reach = params.corner_radius + 3.0 * params.tolerance / sine.abs().max(0.2);
        let reach = reach.min(0.5 * before.length.min(after.length) + params.corner_radius);
        if corner.distance(cut) <= reach {
            return Joint::Corner(corner);
        }
    }
    if p.distance(q) <= params.tolerance
        || (cosine > 0.0 && p.distance(q) <= 2.0 * params.tolerance && sine.abs() > 0.1)
    {
        Joint::Corner(0.5 * (p + q))
    } else {
        Joint::Step(p, q)
    }
}

/// The pieces of a ring with how each meets the next, while some of them make way.
struct Chain<'a> {
    pieces: Vec<Piece>,
    /// Numbers of the pieces before and after each one.
    before: Vec<usize>,
    after: Vec<usize>,
    /// How each piece meets the one after it.
    joints: Vec<Joint>,
    params: &'a PolylineParams,
}

impl<'a> Chain<'a> {
    fn new(pieces: Vec<Piece>, params: &'a PolylineParams) -> Self {
        let n = pieces.len();
        let before = (0..n).map(|i| (i + n - 1) % n).collect();
        let after: Vec<usize> = (0..n).map(|i| (i + 1) % n).collect();
        let joints = (0..n).map(|i| joint(&pieces[i], &pieces[after[i]], params)).collect();
        Self { pieces, before, after, joints, params }
    }

    /// Where a piece starts and ends between its neighbours.
    fn span(&self, i: usize) -> (DVec2, DVec2) {
        let start = match self.joints[self.before[i]] {
            Joint::Corner(c) | Joint::Step(_, c) => c,
        };
        let end = match self.joints[i] {
            Joint::Corner(c) | Joint::Step(c, _) => c,
        };
        (start, end)
    }

    /// Whether its neighbours leave nothing of a piece, or turn it round.
    fn is_turned(&self, i: usize) -> bool {
        let (start, end) = self.span(i);
        (end - start).dot(self.pieces[i].along) <= 1e-9
    }

    /// Takes a piece out: its neighbours, which are returned, now meet where it was.
    fn remove(&mut self, i: usize) -> [usize; 2] {
        let (before, after) = (self.before[i], self.after[i]);
        let middle = 0.5 * (self.pieces[i].ends[0] + self.pieces[i].ends[1]);
        self.pieces[before].ends[1] = middle;
        self.pieces[after].ends[0] = middle;
        (self.after[before], self.before[after]) = (after, before);
        self.joints[before] = joint(&self.pieces[before], &self.pieces[after], self.params);
        [before, after]
    }
}

/// The chain of segments: of the pieces that were turned round the shortest makes way first, until none is left.
fn chain(pieces: Vec<Piece>, params: &PolylineParams) -> Vec<LineSegment> {
    let mut left = pieces.len();
    if left < 2 {
        return Vec::new();
    }
    let mut chain = Chain::new(pieces, params);
    let mut stays = vec![true; left];
    // Lengths are not negative, so that their bits are in their order.
    let key = |chain: &Chain<'_>, i: usize| Reverse((chain.pieces[i].length.to_bits(), i));
    let mut turned: BinaryHeap<_> = (0..left).filter(|&i| chain.is_turned(i)).map(|i| key(&chain, i)).collect();
    while let Some(Reverse((_, i))) = turned.pop() {
        if !stays[i] || !chain.is_turned(i) {
            continue;
        }
        stays[i] = false;
        left -= 1;
        if left < 2 {
            return Vec::new();
        }
        for k in chain.remove(i) {
            if chain.is_turned(k) {
                turned.push(key(&chain, k));
            }
        }
    }
    let mut out = Vec::with_capacity(left);
    for i in (0..stays.len()).filter(|&i| stays[i]) {
        let (a, b) = chain.span(i);
        out.push(LineSegment { a, b, weight: chain.pieces[i].length, source: Source::Outline });
        if let Joint::Step(a, b) = chain.joints[i] {
            out.push(LineSegment { a, b, weight: a.distance(b), source: Source::Outline });
        }
    }
    out
}

#[cfg(test)]
mod tests;
