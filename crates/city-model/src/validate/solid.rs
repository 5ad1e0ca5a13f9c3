//! Solids whose shells are valid: 401–405.

use super::snap::Snapped;
use super::triangles::{meet, segment_meets_triangle, sweep};
use super::{Code, Issue, Tolerances, shell};
use crate::Shell;
use gable_geometry::DVec3;

/// Checks a solid without cavities: its shell (101–307), and that the faces look outward (405).
/// Complexity as [`super::validate_shell`]. Never panics, whatever the input.
#[must_use]
pub fn validate_solid(outer: &Shell, tolerances: &Tolerances) -> Vec<Issue> {
    validate_solid_with_cavities(outer, &[], tolerances)
}

/// Checks a solid with cavities, whose shells look into the cavity (away from the solid's matter).
///
/// Each shell is checked for itself first; issues of cavity `k` say so. Shells may meet in points only: contact along
/// a line or an area is reported as 401, so that the interior cannot fall apart (404) unseen. (val3dity lets shells
/// touch along lines and tests 404 with Nef polyhedra.)
#[must_use]
pub fn validate_solid_with_cavities(outer: &Shell, cavities: &[Shell], tolerances: &Tolerances) -> Vec<Issue> {
    let mut issues = Vec::new();
    let mut parts = Vec::new();
    for (k, shell) in std::iter::once(outer).chain(cavities).enumerate() {
        let checked = Snapped::new(shell, tolerances.snap)
            .map_err(|issue| vec![issue])
            .and_then(|snapped| Ok((shell::check(&snapped, tolerances)?, snapped)));
        match checked {
            Ok((triangles, snapped)) => parts.push((snapped.points, triangles)),
            Err(found) if k == 0 => issues.extend(found),
            Err(found) => issues.extend(found.into_iter().map(|mut issue| {
                issue.message = format!("cavity {}: {}", k - 1, issue.message);
                issue
            })),
        }
    }
    if !issues.is_empty() {
        return issues;
    }
    for k in 1..parts.len() {
        for j in 0..k {
            if let Some(code) = relation(&parts[j], &parts[k], j == 0, tolerances.snap) {
                let name = if j == 0 { "the outer shell".to_owned() } else { format!("cavity {}", j - 1) };
                let how = match code {
                    Code::IntersectionShells => "meets",
                    Code::DuplicatedShells => "equals",
                    Code::InnerShellOutside if j == 0 => "is outside",
                    _ => "is nested with",
                };
                issues.push(Issue::new(code, None, format!("cavity {} {how} {name}", k - 1)));
            }
        }
    }
    if !issues.is_empty() {
        return issues;
    }
    for (k, (points, triangles)) in parts.iter().enumerate() {
        let volume = signed_volume(points, triangles);
        if k == 0 && volume <= 0.0 {
            let message = format!("the faces look inward: the volume is {volume:.4} m³");
            issues.push(Issue::new(Code::WrongShellOrientation, None, message));
        } else if k > 0 && volume >= 0.0 {
            let message = format!("the faces of cavity {} look into the solid", k - 1);
            issues.push(Issue::new(Code::WrongShellOrientation, None, message));
        }
    }
    issues
}

type Mesh = (Vec<DVec3>, Vec<(usize, [u32; 3])>);

/// How a cavity relates to the outer shell or to an earlier cavity, if that is not allowed.
fn relation(first: &Mesh, cavity: &Mesh, outer: bool, snap: f64) -> Option<Code> {
    if first.0.len() == cavity.0.len() && cavity.0.iter().all(|p| first.0.iter().any(|q| p.distance(*q) <= snap)) {
        return Some(Code::DuplicatedShells);
    }
    let at = |mesh: &Mesh, t: [u32; 3]| t.map(|i| mesh.0[i as usize]);
    let hit = sweep(&first.0, &first.1, &cavity.0, &cavity.1, |i, j| {
        let (s, t) = (at(first, first.1[i].1), at(cavity, cavity.1[j].1));
        meet(s, t) && !in_one_corner(s, t)
    });
    if hit.is_some() {
        return Some(Code::IntersectionShells);
    }
    let inside = |mesh: &Mesh, other: &Mesh| other.0.iter().filter(|p| !on_mesh(mesh, **p)).any(|p| contains(mesh, *p));
    match outer {
        true if !inside(first, cavity) => Some(Code::InnerShellOutside),
        false if inside(first, cavity) || inside(cavity, first) => Some(Code::InnerShellOutside),
        _ => None,
    }
}

/// Whether triangles that meet share a corner and nothing else.
fn in_one_corner(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    let common: Vec<_> = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).filter(|&(i, j)| s[i] == t[j]).collect();
    let [(i, j)] = common.as_slice() else { return false };
    let far = |t: [DVec3; 3], k: usize| (t[(k + 1) % 3], t[(k + 2) % 3]);
    let ((a, b), (c, d)) = (far(s, *i), far(t, *j));
    !segment_meets_triangle(a, b, t) && !segment_meets_triangle(c, d, s)
}

fn on_mesh(mesh: &Mesh, p: DVec3) -> bool {
    mesh.0.contains(&p)
}

/// Volume enclosed by triangles, about the first point.
pub(super) fn signed_volume(points: &[DVec3], triangles: &[(usize, [u32; 3])]) -> f64 {
    let origin = points[0];
    let corners = triangles.iter().map(|(_, t)| t.map(|i| points[i as usize] - origin));
    corners.map(|[a, b, c]| a.dot(b.cross(c))).sum::<f64>() / 6.0
}

/// Whether a closed mesh contains a point off its surface, by its winding number: the sum of the solid angles under
/// which the point sees the triangles (van Oosterom and Strackee 1983), over 4π. O(triangles), without special cases.
pub(super) fn contains(mesh: &Mesh, p: DVec3) -> bool {
    let mut angle = 0.0;
    for (_, t) in &mesh.1 {
        let [a, b, c] = t.map(|i| mesh.0[i as usize] - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let numerator = a.dot(b.cross(c));
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        angle += 2.0 * numerator.atan2(denominator);
    }
    angle.abs() > std::f64::consts::TAU
}
