//! Shells whose polygons are valid: 301–307.

use super::snap::Snapped;
use super::{Code, Issue, Tolerances, polygons, triangles};
use crate::Shell;
use gable_geometry::DisjointSets;
use std::collections::BTreeMap;

/// Checks the faces (101–208) and, if they are all valid, that they make a closed 2-manifold, oriented alike and free
/// of self-intersections (301–307).
///
/// Closedness, manifoldness and orientation are judged on the graph of edges; self-intersection on the triangles of
/// different faces with exact predicates, pairs being found by a sweep. O(n log n + k) for k pairs of triangles whose
/// boxes meet. Never panics, whatever the input.
#[must_use]
pub fn validate_shell(shell: &Shell, tolerances: &Tolerances) -> Vec<Issue> {
    match Snapped::new(shell, tolerances.snap) {
        Ok(snapped) => check(&snapped, tolerances).err().unwrap_or_default(),
        Err(issue) => vec![issue],
    }
}

/// The shell's triangles with their faces, or its defects.
pub(super) fn check(snapped: &Snapped, tolerances: &Tolerances) -> Result<Vec<(usize, [u32; 3])>, Vec<Issue>> {
    let (issues, per_face) = polygons(snapped, tolerances);
    if !issues.is_empty() {
        return Err(issues);
    }
    if snapped.faces.len() < 4 {
        let message = format!("a shell needs four polygons, this one has {}", snapped.faces.len());
        return Err(vec![Issue::new(Code::TooFewPolygons, None, message)]);
    }
    let sides = edge_sides(snapped);
    let issues = edges(snapped, &sides);
    if !issues.is_empty() {
        return Err(issues);
    }
    let all: Vec<_> =
        per_face.into_iter().enumerate().flat_map(|(f, own)| own.into_iter().map(move |t| (f, t))).collect();
    let issues = connectivity(snapped, &sides, &all);
    if !issues.is_empty() {
        return Err(issues);
    }
    if let Some((i, j)) = triangles::first_intersection(&snapped.points, &all) {
        let (f, g) = (all[i].0, all[j].0);
        let place = Snapped::place(snapped.points[all[i].1[0] as usize]);
        let message = format!("it meets face {g} near {place} elsewhere than in shared corners and edges");
        return Err(vec![Issue::new(Code::ShellSelfIntersection, f, message)]);
    }
    Ok(all)
}

/// A use of an edge by a face: whether it runs from the lower to the higher vertex, and the face.
type Side = (bool, usize);

fn edge_sides(snapped: &Snapped) -> BTreeMap<(u32, u32), Vec<Side>> {
    let mut sides: BTreeMap<(u32, u32), Vec<Side>> = BTreeMap::new();
    for (f, ring) in snapped.faces.iter().enumerate().flat_map(|(f, rings)| rings.iter().map(move |ring| (f, ring))) {
        for k in 0..ring.len() {
            let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
            sides.entry((a.min(b), a.max(b))).or_default().push((a < b, f));
        }
    }
    sides
}

/// 302, 304, 307, edge by edge.
fn edges(snapped: &Snapped, sides: &BTreeMap<(u32, u32), Vec<Side>>) -> Vec<Issue> {
    let mut issues = Vec::new();
    for (&(a, b), uses) in sides {
        let place = || {
            let [a, b] = [a, b].map(|i| Snapped::place(snapped.points[i as usize]));
            format!("the edge {a} {b}")
        };
        let face = uses[0].1;
        match uses.as_slice() {
            [_] => issues.push(Issue::new(Code::ShellNotClosed, face, format!("{} has one polygon", place()))),
            [s, t] if s.0 == t.0 => {
                let message = format!("{} runs the same way in face {}", place(), t.1);
                issues.push(Issue::new(Code::WrongPolygonOrientation, face, message));
            }
            [_, _] => {}
            more => {
                let message = format!("{} has {} polygons", place(), more.len());
                issues.push(Issue::new(Code::NonManifoldEdge, face, message));
            }
        }
    }
    issues
}

/// 305, then 303: every vertex must have one fan of triangles around it. (Rings do not tell: where a hole touches its outer
/// ring, the corners of a face at that vertex belong to two rings each.)
fn connectivity(
    snapped: &Snapped,
    sides: &BTreeMap<(u32, u32), Vec<Side>>,
    triangles: &[(usize, [u32; 3])],
) -> Vec<Issue> {
    let mut sets = DisjointSets::new(snapped.faces.len());
    for uses in sides.values() {
        sets.join(uses[0].1, uses[1].1);
    }
    let components = sets.sets().len();
    if components > 1 {
        let message = format!("the shell has {components} parts that no edge connects");
        return vec![Issue::new(Code::MultipleComponents, None, message)];
    }
    // At a vertex, corners of triangles link the edges before and after it; each circle of links is a fan.
    let mut links: Vec<(u32, u32, u32, usize)> =
        triangles.iter().flat_map(|&(f, [a, b, c])| [(a, c, b, f), (b, a, c, f), (c, b, a, f)]).collect();
    links.sort_unstable();
    let mut issues = Vec::new();
    for corners in links.chunk_by(|a, b| a.0 == b.0) {
        // Leaving edges: each corner leads from its edge before to its edge after, so one fan is one cycle.
        let start = corners[0].1;
        let (mut at, mut length) = (start, 0);
        loop {
            let next = corners.partition_point(|c| c.1 < at);
            match corners.get(next) {
                Some(corner) if corner.1 == at && length < corners.len() => at = corner.2,
                _ => break,
            }
            length += 1;
            if at == start {
                break;
            }
        }
        if length < corners.len() {
            let place = Snapped::place(snapped.points[corners[0].0 as usize]);
            issues.push(Issue::new(
                Code::NonManifoldVertex,
                corners[0].3,
                format!("the shell touches itself at {place}"),
            ));
        }
    }
    issues
}
