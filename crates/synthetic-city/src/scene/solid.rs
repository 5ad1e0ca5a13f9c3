//! Closed shells from an envelope: roofs on their planes, vertical walls, a horizontal base.
//!
//! Every vertex is a node of the plan at one of the heights that roofs reach there, so faces that
//! meet share their vertices. Coplanar neighbours are then merged and vertices that no longer part
//! anything are dropped: each roof plane, wall and base is one polygon.

use super::envelope::Envelope;
use gable_city_model::{Attributes, Face, Semantic, Shell};
use gable_geometry::{DVec2, DVec3, Plane, dvec2, dvec3, ring_area, ring_contains};
use std::collections::{BTreeMap, BTreeSet};

/// Heights closer than this are one vertex, metres.
const LEVEL: f64 = 1e-4;
/// No edge of a finished shell is shorter, metres.
const SHORTEST: f64 = 0.02;

/// Which polygons may be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Ground,
    Roof(usize),
    /// Direction and offset of a vertical plane, rounded to 1e-5.
    Wall(i64, i64, i64),
}

struct Draft {
    vertices: Vec<DVec3>,
    faces: Vec<(Key, Vec<Vec<u32>>)>,
}

/// The solid between a base height and the envelope; `None` if it would not be a 2-manifold or has
/// edges too short to matter.
pub(crate) fn solid(envelope: &Envelope, base: f64) -> Option<Shell> {
    solid_under(envelope, base, |face| envelope.planes[face])
}

/// The block model: the same plan under one height.
pub(crate) fn block(envelope: &Envelope, base: f64, height: f64) -> Option<Shell> {
    solid_under(envelope, base, |_| Plane::horizontal(height))
}

fn solid_under(envelope: &Envelope, base: f64, plane: impl Fn(usize) -> Plane) -> Option<Shell> {
    let draft = draft(envelope, base, &plane);
    let shell = dissolve(&draft)?;
    (is_manifold(&shell) && shortest_edge(&shell) > SHORTEST).then_some(shell)
}

fn draft(envelope: &Envelope, base: f64, plane: &dyn Fn(usize) -> Plane) -> Draft {
    let nodes = &envelope.nodes;
    let mut levels: Vec<Vec<f64>> = vec![vec![base]; nodes.len()];
    let mut left: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for (f, face) in envelope.faces.iter().enumerate() {
        for ring in &face.rings {
            for i in 0..ring.len() {
                levels[ring[i]].push(plane(face.plane).height(nodes[ring[i]]));
                left.insert((ring[i], ring[(i + 1) % ring.len()]), f);
            }
        }
    }
    for list in &mut levels {
        list.sort_by(f64::total_cmp);
        list.dedup_by(|a, b| *a - *b < LEVEL);
    }
    let mut vertices = Vec::new();
    let first: Vec<usize> = levels
        .iter()
        .zip(nodes)
        .map(|(list, p)| {
            vertices.extend(list.iter().map(|&z| p.extend(z)));
            vertices.len() - list.len()
        })
        .collect();
    let level = |node: usize, z: f64| {
        let list = &levels[node];
        (0..list.len()).min_by(|&i, &j| (list[i] - z).abs().total_cmp(&(list[j] - z).abs())).unwrap_or(0)
    };
    let roof_level = |node: usize, f: Option<&usize>| {
        f.map_or(0, |&f| level(node, plane(envelope.faces[f].plane).height(nodes[node])))
    };
    let mut faces = Vec::new();
    for (f, face) in envelope.faces.iter().enumerate() {
        let same = plane(face.plane);
        let key = (0..envelope.planes.len()).find(|&k| plane(k) == same).unwrap_or(face.plane);
        let lift =
            |ring: &Vec<usize>| ring.iter().map(|&n| (first[n] + roof_level(n, Some(&f))) as u32).collect::<Vec<_>>();
        faces.push((Key::Roof(key), face.rings.iter().map(lift).collect()));
        let drop = |ring: &Vec<usize>| ring.iter().rev().map(|&n| first[n] as u32).collect::<Vec<_>>();
        faces.push((Key::Ground, face.rings.iter().map(drop).collect()));
    }
    for (&(u, v), &f) in &left {
        let other = left.get(&(v, u));
        let (top_u, top_v) = (roof_level(u, Some(&f)), roof_level(v, Some(&f)));
        let (low_u, low_v) = (roof_level(u, other), roof_level(v, other));
        if top_u < low_u || top_v < low_v || (top_u == low_u && top_v == low_v) {
            continue;
        }
        let mut ring: Vec<u32> = vec![(first[u] + low_u) as u32];
        ring.extend((low_v..=top_v).map(|l| (first[v] + l) as u32));
        ring.extend((low_u + 1..=top_u).rev().map(|l| (first[u] + l) as u32));
        faces.push((wall_key(nodes[u], nodes[v]), vec![ring]));
    }
    Draft { vertices, faces }
}

fn wall_key(a: DVec2, b: DVec2) -> Key {
    // Corner coordinates carry about 1e-9 of error, so direction and offset are rounded well above it.
    let d = (b - a).normalize();
    let round = |x: f64| (x * 1e5).round() as i64;
    Key::Wall(round(d.x), round(d.y), (d.perp_dot(a) * 1e4).round() as i64)
}

/// Merges neighbours with the same key and drops vertices between two collinear edges.
fn dissolve(draft: &Draft) -> Option<Shell> {
    let mut owner: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (f, (_, rings)) in draft.faces.iter().enumerate() {
        for (a, b) in edges(rings) {
            if owner.insert((a, b), f).is_some() {
                return None;
            }
        }
    }
    let mut group: Vec<usize> = (0..draft.faces.len()).collect();
    for (&(a, b), &f) in &owner {
        let g = *owner.get(&(b, a))?;
        if draft.faces[f].0 == draft.faces[g].0 {
            let (x, y) = (root(&group, f), root(&group, g));
            group[x.max(y)] = x.min(y);
        }
    }
    let mut border: BTreeMap<usize, BTreeMap<u32, Vec<u32>>> = BTreeMap::new();
    for (&(a, b), &f) in &owner {
        let own = root(&group, f);
        if root(&group, owner[&(b, a)]) != own {
            border.entry(own).or_default().entry(a).or_default().push(b);
        }
    }
    let mut faces: Vec<(Key, Vec<Vec<u32>>)> = Vec::new();
    for (own, next) in border {
        let key = draft.faces[own].0;
        for rings in polygons(&draft.vertices, key, next) {
            faces.push((key, rings));
        }
    }
    let mut neighbours: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for (_, rings) in &faces {
        for (a, b) in edges(rings) {
            neighbours.entry(a).or_default().insert(b);
            neighbours.entry(b).or_default().insert(a);
        }
    }
    let mut index: BTreeMap<u32, u32> = BTreeMap::new();
    let mut vertices = Vec::new();
    let mut out = Vec::new();
    for (key, rings) in faces {
        let rings: Vec<Vec<u32>> = rings
            .iter()
            .map(|ring| {
                let kept = ring.iter().filter(|v| neighbours[v].len() > 2);
                let renumber = |v: &u32| {
                    *index.entry(*v).or_insert_with(|| {
                        vertices.push(draft.vertices[*v as usize]);
                        vertices.len() as u32 - 1
                    })
                };
                kept.map(renumber).collect()
            })
            .collect();
        if rings.iter().any(|r: &Vec<u32>| r.len() < 3) {
            return None;
        }
        let semantic = match key {
            Key::Ground => Semantic::GroundSurface,
            Key::Roof(_) => Semantic::RoofSurface,
            Key::Wall(..) => Semantic::WallSurface,
        };
        out.push(Face { rings, semantic, attributes: Attributes::new() });
    }
    Some(Shell { vertices, faces: out })
}

fn root(group: &[usize], mut f: usize) -> usize {
    while group[f] != f {
        f = group[f];
    }
    f
}

fn edges(rings: &[Vec<u32>]) -> impl Iterator<Item = (u32, u32)> {
    rings.iter().flat_map(|r| (0..r.len()).map(|i| (r[i], r[(i + 1) % r.len()])))
}

/// Rings of the border of a merged face, sorted into polygons with holes. At a vertex where the
/// border touches itself the sharpest left turn is taken, so that no ring touches itself.
fn polygons(vertices: &[DVec3], key: Key, mut next: BTreeMap<u32, Vec<u32>>) -> Vec<Vec<Vec<u32>>> {
    let flat = |v: u32| {
        let p = vertices[v as usize];
        match key {
            Key::Ground => dvec2(p.y, p.x),
            Key::Roof(_) => p.truncate(),
            Key::Wall(x, y, _) => dvec2(p.truncate().dot(dvec2(x as f64, y as f64).normalize()), p.z),
        }
    };
    let mut rings: Vec<Vec<u32>> = Vec::new();
    while let Some(start) = next.iter().find(|(_, to)| !to.is_empty()).map(|(&a, _)| a) {
        let mut ring = vec![start];
        let mut at = start;
        let mut came = None;
        while let Some(choices) = next.get_mut(&at).filter(|c| !c.is_empty()) {
            let pick = match came {
                Some(from) if choices.len() > 1 => {
                    let back: DVec2 = flat(from) - flat(at);
                    let turn = |to: u32| {
                        let a = (flat(to) - flat(at)).to_angle() - back.to_angle();
                        a.rem_euclid(std::f64::consts::TAU)
                    };
                    // The interior is on the left: the next edge clockwise from where we came.
                    (0..choices.len()).max_by(|&i, &j| turn(choices[i]).total_cmp(&turn(choices[j]))).unwrap_or(0)
                }
                _ => 0,
            };
            let to = choices.swap_remove(pick);
            if to == start {
                break;
            }
            ring.push(to);
            came = Some(at);
            at = to;
        }
        rings.push(ring);
    }
    let place = |r: &[u32]| r.iter().map(|&v| flat(v)).collect::<Vec<_>>();
    let (outer, holes): (Vec<_>, Vec<_>) = rings.into_iter().partition(|r| ring_area(&place(r)) > 0.0);
    let outlines: Vec<Vec<DVec2>> = outer.iter().map(|r| place(r)).collect();
    let mut out: Vec<Vec<Vec<u32>>> = outer.into_iter().map(|r| vec![r]).collect();
    for hole in holes {
        let ring = place(&hole);
        let probe = ring[0].midpoint(ring[1]);
        if let Some(i) = (0..out.len()).find(|&i| ring_contains(&outlines[i], probe)) {
            out[i].push(hole);
        }
    }
    out
}

/// Whether every directed edge has exactly one partner.
pub(crate) fn is_manifold(shell: &Shell) -> bool {
    let mut seen: BTreeSet<(u32, u32)> = BTreeSet::new();
    for face in &shell.faces {
        if edges(&face.rings).any(|e| !seen.insert(e)) {
            return false;
        }
    }
    !shell.faces.is_empty() && seen.iter().all(|&(a, b)| seen.contains(&(b, a)))
}

fn shortest_edge(shell: &Shell) -> f64 {
    let mut least = f64::INFINITY;
    for face in &shell.faces {
        for (a, b) in edges(&face.rings) {
            least = least.min(shell.vertices[a as usize].distance(shell.vertices[b as usize]));
        }
    }
    least
}

/// Enclosed volume of a shell, m³, by the divergence theorem over fans (exact for planar faces with holes).
#[must_use]
pub(crate) fn shell_volume(shell: &Shell) -> f64 {
    let Some(&origin) = shell.vertices.first() else { return 0.0 };
    let mut six = 0.0;
    for face in &shell.faces {
        for ring in &face.rings {
            let p = |i: usize| shell.vertices[ring[i] as usize] - origin;
            for i in 1..ring.len().saturating_sub(1) {
                six += p(0).dot(p(i).cross(p(i + 1)));
            }
        }
    }
    six / 6.0
}

/// The horizontal faces of a shell with a meaning, seen from above, at a height: footprints and roof edges.
pub(crate) fn outline(envelope: &Envelope, height: f64, semantic: Semantic) -> Option<Shell> {
    let lid = block(envelope, height - 1.0, height)?;
    let mut out = Shell::default();
    for face in lid.faces.iter().filter(|f| f.semantic == Semantic::RoofSurface) {
        let mut add = |v: &u32| {
            let p = lid.vertices[*v as usize];
            out.vertices.push(dvec3(p.x, p.y, height));
            out.vertices.len() as u32 - 1
        };
        let rings = face.rings.iter().map(|r| r.iter().map(&mut add).collect()).collect();
        out.faces.push(Face { rings, semantic, attributes: Attributes::new() });
    }
    Some(out)
}
