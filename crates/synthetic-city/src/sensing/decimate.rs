//! Edge collapse with quadric error (Garland and Heckbert 1997) down to a number of faces.
//!
//! Borders are thinned along themselves only and held by planes that stand on them, so that tiles keep
//! meeting to within some centimetres; non-manifold edges stay as they are.
//! O(n log n); ties go by vertex number, so the result depends on the input only.

use super::TriMesh;
use gable_geometry::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Symmetric 4×4 form: squared distance to weighted planes.
#[derive(Clone, Copy, Default)]
struct Quadric {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
    linear: DVec3,
    constant: f64,
}

impl Quadric {
    fn plane(n: DVec3, point: DVec3, weight: f64) -> Self {
        let d = -n.dot(point);
        let (m, w) = (n * weight, weight);
        Self {
            xx: m.x * n.x,
            xy: m.x * n.y,
            xz: m.x * n.z,
            yy: m.y * n.y,
            yz: m.y * n.z,
            zz: m.z * n.z,
            linear: m * d,
            constant: w * d * d,
        }
    }

    fn add(&mut self, o: &Self) {
        self.xx += o.xx;
        self.xy += o.xy;
        self.xz += o.xz;
        self.yy += o.yy;
        self.yz += o.yz;
        self.zz += o.zz;
        self.linear += o.linear;
        self.constant += o.constant;
    }

    fn times(&self, p: DVec3) -> DVec3 {
        DVec3::new(
            self.xx * p.x + self.xy * p.y + self.xz * p.z,
            self.xy * p.x + self.yy * p.y + self.yz * p.z,
            self.xz * p.x + self.yz * p.y + self.zz * p.z,
        )
    }

    fn at(&self, p: DVec3) -> f64 {
        p.dot(self.times(p)) + 2.0 * self.linear.dot(p) + self.constant
    }

    /// Where the form is least (Cramer's rule).
    fn least(&self) -> Option<DVec3> {
        let a = DVec3::new(self.xx, self.xy, self.xz);
        let b = DVec3::new(self.xy, self.yy, self.yz);
        let c = DVec3::new(self.xz, self.yz, self.zz);
        let determinant = a.dot(b.cross(c));
        let scale = self.xx + self.yy + self.zz;
        if determinant.abs() < 1e-9 * scale * scale * scale {
            return None;
        }
        let r = -self.linear;
        let x = r.dot(b.cross(c));
        let y = a.dot(r.cross(c));
        let z = a.dot(b.cross(r));
        Some(DVec3::new(x, y, z) / determinant)
    }
}

struct Candidate {
    cost: f64,
    u: u32,
    v: u32,
    stamp: u32,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.u.cmp(&self.u)).then(other.v.cmp(&self.v))
    }
}

/// Candidates in ascending order. Those that cost more than a limit wait aside until all others are done, so that the heap
/// stays small enough for the caches; the order is that of one heap.
struct Queue {
    heap: BinaryHeap<Candidate>,
    limit: f64,
    later: Vec<Candidate>,
}

impl Queue {
    /// Share of what waits that enters the heap at once.
    const SLICE: usize = 16;

    fn new() -> Self {
        Self { heap: BinaryHeap::new(), limit: f64::NEG_INFINITY, later: Vec::new() }
    }

    fn push(&mut self, candidate: Candidate) {
        if candidate.cost.total_cmp(&self.limit).is_le() {
            self.heap.push(candidate);
        } else {
            self.later.push(candidate);
        }
    }

    /// The cheapest candidate; on the way, those that wait and no longer hold are dropped.
    fn pop(&mut self, holds: impl Fn(&Candidate) -> bool) -> Option<Candidate> {
        if self.heap.is_empty() {
            self.later.retain(holds);
            let count = self.later.len();
            let rank = (count / Self::SLICE).max(1000).min(count).checked_sub(1)?;
            let (_, last, _) = self.later.select_nth_unstable_by(rank, |a, b| a.cost.total_cmp(&b.cost));
            self.limit = last.cost;
            let limit = self.limit;
            let waiting = std::mem::take(&mut self.later).into_iter();
            let (now, later): (Vec<_>, Vec<_>) = waiting.partition(|c| c.cost.total_cmp(&limit).is_le());
            self.later = later;
            self.heap = BinaryHeap::from(now);
        }
        self.heap.pop()
    }
}

struct Work {
    /// Coordinates relative to the first vertex, which keeps the forms well conditioned.
    places: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    alive: Vec<bool>,
    around: Vec<Vec<u32>>,
    forms: Vec<Quadric>,
    /// Vertices of non-manifold edges: these never move.
    fixed: Vec<bool>,
    /// Vertices of edges with one face.
    border: Vec<bool>,
    stamps: Vec<u32>,
}

/// Collapses edges until at most `target` faces are left or no edge can be collapsed (Garland and Heckbert 1997). O(n log n).
#[must_use]
pub fn decimate(mesh: &TriMesh, target: usize) -> TriMesh {
    let Some(&origin) = mesh.vertices.first() else { return TriMesh::default() };
    let mut work = prepare(mesh, origin);
    let mut left = work.faces.len();
    let mut queue = Queue::new();
    for face in &work.faces {
        for k in 0..3 {
            let (u, v) = (face[k], face[(k + 1) % 3]);
            if u < v {
                push(&work, &mut queue, u, v);
            }
        }
    }
    let mut around = [Vec::new(), Vec::new()];
    while left > target {
        let Some(best) = queue.pop(|c| work.holds(c)) else { break };
        if !work.holds(&best) {
            continue;
        }
        let (u, v) = (best.u, best.v);
        let place = work.best_place(u, v).0;
        if !work.may_collapse(u, v, place, &mut around) {
            continue;
        }
        left -= work.collapse(u, v, place);
        work.neighbours(u, &mut around[0]);
        for &w in &around[0] {
            push(&work, &mut queue, u.min(w), u.max(w));
        }
    }
    let mut out = TriMesh {
        vertices: work.places.iter().map(|p| *p + origin).collect(),
        faces: work.faces.iter().zip(&work.alive).filter(|(_, a)| **a).map(|(f, _)| *f).collect(),
    };
    out.compact();
    out
}

fn prepare(mesh: &TriMesh, origin: DVec3) -> Work {
    let n = mesh.vertices.len();
    let mut work = Work {
        places: mesh.vertices.iter().map(|p| *p - origin).collect(),
        faces: mesh.faces.clone(),
        alive: vec![true; mesh.faces.len()],
        around: vec![Vec::with_capacity(6); n],
        forms: vec![Quadric::default(); n],
        fixed: vec![false; n],
        border: vec![false; n],
        stamps: vec![0; n],
    };
    let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.faces.len());
    for (f, face) in mesh.faces.iter().enumerate() {
        let [a, b, c] = face.map(|v| work.places[v as usize]);
        let normal = (b - a).cross(c - a);
        let area = normal.length();
        let form = normal.try_normalize().map(|n| Quadric::plane(n, a, area / 6.0)).unwrap_or_default();
        for (k, &v) in face.iter().enumerate() {
            work.around[v as usize].push(f as u32);
            work.forms[v as usize].add(&form);
            let w = face[(k + 1) % 3];
            sides.push((v.min(w), v.max(w), f as u32));
        }
    }
    sides.sort_unstable();
    for same in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (u, v, f) = same[0];
        if same.len() > 2 {
            work.fixed[u as usize] = true;
            work.fixed[v as usize] = true;
        } else if same.len() == 1 {
            work.border[u as usize] = true;
            work.border[v as usize] = true;
            // A plane on the border, upright on its face.
            let (p, q) = (work.places[u as usize], work.places[v as usize]);
            let upright = (q - p).cross(mesh.area_normal(f as usize)).normalize_or_zero();
            let form = Quadric::plane(upright, p, p.distance_squared(q));
            work.forms[u as usize].add(&form);
            work.forms[v as usize].add(&form);
        }
    }
    work
}

fn push(work: &Work, queue: &mut Queue, u: u32, v: u32) {
    if work.fixed[u as usize] && work.fixed[v as usize] {
        return;
    }
    if work.border[u as usize] && work.border[v as usize] && work.shared_faces(u, v) != 1 {
        return;
    }
    let (_, cost) = work.best_place(u, v);
    let stamp = work.stamps[u as usize].wrapping_add(work.stamps[v as usize]);
    queue.push(Candidate { cost, u, v, stamp });
}

impl Work {
    /// Whether an edge is still there, as it was when its cost was found.
    fn holds(&self, c: &Candidate) -> bool {
        let (u, v) = (c.u as usize, c.v as usize);
        c.stamp == self.stamps[u].wrapping_add(self.stamps[v])
            && !self.around[u].is_empty()
            && !self.around[v].is_empty()
    }

    fn best_place(&self, u: u32, v: u32) -> (DVec3, f64) {
        let mut form = self.forms[u as usize];
        form.add(&self.forms[v as usize]);
        let (p, q) = (self.places[u as usize], self.places[v as usize]);
        let held =
            |w: u32, other: u32| self.fixed[w as usize] || (self.border[w as usize] && !self.border[other as usize]);
        let ends: &[DVec3] = match (held(u, v), held(v, u)) {
            (true, _) => &[p],
            (_, true) => &[q],
            _ => &[p, q, p.midpoint(q)],
        };
        if ends.len() == 3
            && let Some(least) = form.least()
            && least.distance(p.midpoint(q)) < 2.0 * p.distance(q)
        {
            return (least, form.at(least));
        }
        let mut best = (ends[0], form.at(ends[0]));
        for &end in &ends[1..] {
            let cost = form.at(end);
            if cost < best.1 {
                best = (end, cost);
            }
        }
        best
    }

    fn shared_faces(&self, u: u32, v: u32) -> usize {
        self.around[u as usize].iter().filter(|&&f| self.faces[f as usize].contains(&v)).count()
    }

    /// The neighbours of a vertex, ascending, in place of what is in `out`.
    fn neighbours(&self, v: u32, out: &mut Vec<u32>) {
        out.clear();
        out.extend(self.around[v as usize].iter().flat_map(|&f| self.faces[f as usize]).filter(|&w| w != v));
        out.sort_unstable();
        out.dedup();
    }

    /// The link condition (at most two common neighbours) and no face that turns over or degenerates.
    fn may_collapse(&self, u: u32, v: u32, place: DVec3, around: &mut [Vec<u32>; 2]) -> bool {
        let [a, b] = around;
        self.neighbours(u, a);
        self.neighbours(v, b);
        let common = a.iter().filter(|w| b.binary_search(w).is_ok()).count();
        if common > 2 || a.len() + b.len() > 22 {
            return false;
        }
        for (own, other) in [(u, v), (v, u)] {
            for &f in &self.around[own as usize] {
                let face = self.faces[f as usize];
                if face.contains(&other) {
                    continue;
                }
                let old = face.map(|w| self.places[w as usize]);
                let new = face.map(|w| if w == own { place } else { self.places[w as usize] });
                let before = (old[1] - old[0]).cross(old[2] - old[0]);
                let after = (new[1] - new[0]).cross(new[2] - new[0]);
                if before.dot(after) < 0.2 * before.length() * after.length() || after.length() < 1e-5 {
                    return false;
                }
            }
        }
        true
    }

    /// Moves `u` to the place and hangs the faces of `v` on it; returns how many faces vanish.
    fn collapse(&mut self, u: u32, v: u32, place: DVec3) -> usize {
        let moved = std::mem::take(&mut self.around[v as usize]);
        let mut gone = 0;
        for f in moved {
            if self.faces[f as usize].contains(&u) {
                self.alive[f as usize] = false;
                gone += 1;
                for w in self.faces[f as usize] {
                    self.around[w as usize].retain(|&g| g != f);
                }
            } else {
                for w in &mut self.faces[f as usize] {
                    if *w == v {
                        *w = u;
                    }
                }
                self.around[u as usize].push(f);
            }
        }
        let form = self.forms[v as usize];
        self.forms[u as usize].add(&form);
        self.places[u as usize] = place;
        self.fixed[u as usize] |= self.fixed[v as usize];
        self.border[u as usize] |= self.border[v as usize];
        // A vertex's stamp only grows, so the sum of two stamps tells old candidates from new ones.
        self.stamps[u as usize] += 1 + self.stamps[v as usize];
        gone
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    /// A square sheet of n × n cells with a ridge.
    fn sheet(n: usize) -> TriMesh {
        let mut mesh = TriMesh::default();
        let w = n as u32 + 1;
        for j in 0..=n {
            for i in 0..=n {
                let z = (n as f64 / 2.0 - (i as f64 - n as f64 / 2.0).abs()) * 0.6;
                mesh.vertices.push(dvec3(i as f64, j as f64, z));
                if i < n && j < n {
                    let k = j as u32 * w + i as u32;
                    mesh.faces.extend([[k, k + 1, k + w + 1], [k, k + w + 1, k + w]]);
                }
            }
        }
        mesh
    }

    #[test]
    fn a_ridge_and_the_border_survive() {
        let fine = sheet(20);
        let coarse = decimate(&fine, 60);
        assert!(coarse.faces.len() <= 60 && coarse.faces.len() >= 6);
        let area = |m: &TriMesh| (0..m.faces.len()).map(|f| m.area_normal(f).length() / 2.0).sum::<f64>();
        assert!((area(&coarse) / area(&fine) - 1.0).abs() < 1e-6);
        for p in &coarse.vertices {
            let z = (10.0 - (p.x - 10.0).abs()) * 0.6;
            assert!((p.z - z).abs() < 1e-6, "{p} has left the sheet");
        }
        for corner in [dvec3(0.0, 0.0, 0.0), dvec3(20.0, 20.0, 0.0), dvec3(10.0, 0.0, 6.0)] {
            assert!(coarse.vertices.iter().any(|p| p.distance(corner) < 1e-6), "{corner} is gone");
        }
    }

    #[test]
    fn the_queue_has_the_order_of_one_heap() {
        let mut random = gable_geometry::Counter::new(4);
        let mut candidate = |v: u32| {
            let cost = (random.unit() * 5000.0).floor() / 100.0;
            Candidate { cost, u: v % 7, v, stamp: u32::from(random.unit() < 0.3) }
        };
        let copy = |c: &Candidate| Candidate { cost: c.cost, u: c.u, v: c.v, stamp: c.stamp };
        let (mut queue, mut heap) = (Queue::new(), BinaryHeap::new());
        let holds = |c: &Candidate| c.stamp == 0;
        for v in 0..40_000 {
            let c = candidate(v);
            heap.push(copy(&c));
            queue.push(c);
        }
        for v in 40_000..60_000 {
            let expected = std::iter::from_fn(|| heap.pop()).find(holds).map(|c| (c.u, c.v));
            let found = std::iter::from_fn(|| queue.pop(holds)).find(holds).map(|c| (c.u, c.v));
            assert_eq!(found, expected);
            let c = candidate(v);
            heap.push(copy(&c));
            queue.push(c);
        }
    }

    #[test]
    fn nothing_happens_to_a_mesh_that_is_coarse_enough() {
        let mesh = sheet(3);
        assert_eq!(decimate(&mesh, 18).faces.len(), 18);
        assert!(decimate(&TriMesh::default(), 5).faces.is_empty());
    }
}
