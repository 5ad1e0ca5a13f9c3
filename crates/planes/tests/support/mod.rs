//! Height maps of roofs with known planes, as photogrammetry would see them.

use gable_geometry::{Counter, DVec2, Plane, dvec2};
use gable_raster::{GridWindow, Raster};

/// A part of a building: a rectangle roofed by the lower envelope of some planes.
pub(crate) struct Body {
    pub(crate) min: DVec2,
    pub(crate) max: DVec2,
    pub(crate) planes: Vec<Plane>,
}

/// A roof: the upper envelope of its bodies.
pub(crate) struct Roof {
    pub(crate) name: &'static str,
    pub(crate) bodies: Vec<Body>,
}

/// What photogrammetry makes of it.
pub(crate) struct Scene {
    pub(crate) height: Raster<f32>,
    pub(crate) mask: Raster<bool>,
    /// Index of the true plane over all bodies, and `usize::MAX` on the ground.
    pub(crate) truth: Vec<usize>,
}

/// A plane that falls at `degrees` from the line through `at` in the direction `down`.
pub(crate) fn pitch(at: DVec2, z: f64, down: DVec2, degrees: f64) -> Plane {
    let g = -degrees.to_radians().tan() * down.normalize();
    Plane { a: g.x, b: g.y, c: z - g.dot(at) }
}

impl Roof {
    pub(crate) fn planes(&self) -> Vec<Plane> {
        self.bodies.iter().flat_map(|b| b.planes.iter().copied()).collect()
    }

    /// Height and index of the plane at a point; `None` off the roof.
    fn top(&self, p: DVec2) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        let mut first = 0;
        for body in &self.bodies {
            let inside = p.cmpge(body.min).all() && p.cmple(body.max).all();
            if inside {
                let low = body.planes.iter().enumerate().map(|(k, q)| (q.height(p), first + k));
                let low = low.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
                if best.is_none_or(|b| low.0 > b.0) {
                    best = Some(low);
                }
            }
            first += body.planes.len();
        }
        best
    }

    /// Rotates about the origin, blurs by `round` metres (inside the roof, with eaves that drop), adds noise of the
    /// given rms that is correlated over about 1.3 m (0.5) to 4.5 m (0.1), and one pixel of ground in the mask.
    pub(crate) fn seen(&self, turn: f64, round: f64, noise: f64, seed: u64) -> Scene {
        let step = 0.2;
        let mut bounds = gable_geometry::Box2::default();
        let back = DVec2::from_angle(-turn);
        for b in &self.bodies {
            for c in [b.min, b.max, dvec2(b.min.x, b.max.y), dvec2(b.max.x, b.min.y)] {
                let c = DVec2::from_angle(turn).rotate(c);
                bounds.min = bounds.min.min(c);
                bounds.max = bounds.max.max(c);
            }
        }
        let window = GridWindow::covering(bounds.grown(2.0), step);
        let top: Vec<Option<(f64, usize)>> = (0..window.len())
            .map(|p| self.top(back.rotate(window.centre(p % window.width, p / window.width))))
            .collect();
        let on: Vec<f64> = top.iter().map(|t| f64::from(u8::from(t.is_some()))).collect();
        let z: Vec<f64> = top.iter().map(|t| t.map_or(0.0, |t| t.0)).collect();
        let (zb, nb) = (blur(&z, window, round), blur(&on, window, round));
        let nb_small = blur(&on, window, 0.25);
        let mut rng = Counter::new(seed);
        let white = |rng: &mut Counter| -> Vec<f64> { (0..window.len()).map(|_| rng.normal()).collect() };
        let fine = unit(blur(&white(&mut rng), window, 0.7));
        let coarse = unit(blur(&white(&mut rng), window, 1.6));
        let height = (0..window.len()).map(|p| {
            if top[p].is_none() {
                return 0.05 * coarse[p];
            }
            let drop = 0.5 * (1.0 - nb_small[p]);
            zb[p] / nb[p] - drop + noise * (0.7f64.sqrt() * fine[p] + 0.3f64.sqrt() * coarse[p])
        });
        let height = Raster::new(window, height.map(|h| h as f32).collect());
        let (w, h) = (window.width as isize, window.height as isize);
        let near = |p: usize| {
            let (i, j) = (p as isize % w, p as isize / w);
            (-1..=1).any(|dj| {
                (-1..=1).any(|di| {
                    let (u, v) = (i + di, j + dj);
                    u >= 0 && v >= 0 && u < w && v < h && on[(v * w + u) as usize] > 0.0
                })
            })
        };
        let mask = Raster::new(window, (0..window.len()).map(near).collect());
        Scene { height, mask, truth: top.iter().map(|t| t.map_or(usize::MAX, |t| t.1)).collect() }
    }
}

fn unit(mut values: Vec<f64>) -> Vec<f64> {
    let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    values.iter_mut().for_each(|v| *v /= rms);
    values
}

fn blur(values: &[f64], window: GridWindow, sigma: f64) -> Vec<f64> {
    let (w, h) = (window.width as isize, window.height as isize);
    let r = (3.0 * sigma / window.step).ceil() as isize;
    let kernel: Vec<f64> = (-r..=r).map(|k| (-0.5 * (k as f64 * window.step / sigma).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    let pass = |from: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        (0..w * h)
            .map(|p| {
                let (i, j) = (p % w, p / w);
                let at = |k: isize| (i + dx * k).clamp(0, w - 1) + (j + dy * k).clamp(0, h - 1) * w;
                (-r..=r).map(|k| kernel[(k + r) as usize] * from[at(k) as usize]).sum::<f64>() / sum
            })
            .collect()
    };
    pass(&pass(values, 1, 0), 0, 1)
}

const EAST: DVec2 = DVec2::new(1.0, 0.0);
const NORTH: DVec2 = DVec2::new(0.0, 1.0);

/// A gabled body whose ridge runs along x (or y).
pub(crate) fn gabled(min: DVec2, max: DVec2, ridge: f64, degrees: f64, along_x: bool) -> Body {
    let (middle, down) = (0.5 * (min + max), if along_x { NORTH } else { EAST });
    Body { min, max, planes: vec![pitch(middle, ridge, down, degrees), pitch(middle, ridge, -down, degrees)] }
}

/// A hipped body with equal slopes on all sides.
pub(crate) fn hipped(min: DVec2, max: DVec2, eaves: f64, degrees: f64) -> Body {
    let planes =
        [(min, -EAST), (max, EAST), (min, -NORTH), (max, NORTH)].map(|(at, down)| pitch(at, eaves, down, degrees));
    Body { min, max, planes: planes.to_vec() }
}

pub(crate) fn flat(min: DVec2, max: DVec2, z: f64) -> Body {
    Body { min, max, planes: vec![Plane::horizontal(z)] }
}

/// The roofs that every detector must understand.
pub(crate) fn catalogue() -> Vec<Roof> {
    let d = dvec2;
    let one = |name, body| Roof { name, bodies: vec![body] };
    let mut mansard = hipped(d(0.0, 0.0), d(16.0, 12.0), 6.0, 65.0);
    mansard.planes.extend(hipped(d(1.5, 1.5), d(14.5, 10.5), 6.0 + 1.5 * 65f64.to_radians().tan(), 20.0).planes);
    vec![
        one("gable 40", gabled(d(0.0, 0.0), d(12.0, 9.0), 10.0, 40.0, true)),
        one("gable 20", gabled(d(0.0, 0.0), d(10.0, 8.0), 8.0, 20.0, true)),
        one("gable 10", gabled(d(0.0, 0.0), d(14.0, 10.0), 8.0, 10.0, true)),
        one("gable 5", gabled(d(0.0, 0.0), d(20.0, 14.0), 8.0, 5.0, true)),
        one("hip 30", hipped(d(0.0, 0.0), d(14.0, 10.0), 6.0, 30.0)),
        one("hip 45 small", hipped(d(0.0, 0.0), d(9.0, 7.0), 6.0, 45.0)),
        one("pyramid 25", hipped(d(0.0, 0.0), d(10.0, 10.0), 6.0, 25.0)),
        one("flat", flat(d(0.0, 0.0), d(20.0, 15.0), 9.0)),
        one("shed 8", Body { min: d(0.0, 0.0), max: d(10.0, 8.0), planes: vec![pitch(d(0.0, 0.0), 7.0, NORTH, 8.0)] }),
        one("mansard", mansard),
        Roof {
            name: "L of gables",
            bodies: vec![
                gabled(d(0.0, 0.0), d(16.0, 8.0), 9.0, 35.0, true),
                gabled(d(0.0, 0.0), d(8.0, 16.0), 9.0, 35.0, false),
            ],
        },
        Roof {
            name: "terraced flats",
            bodies: vec![
                flat(d(0.0, 0.0), d(12.0, 10.0), 6.0),
                flat(d(12.0, 0.0), d(20.0, 10.0), 7.0),
                flat(d(4.0, 4.0), d(8.0, 8.0), 8.5),
            ],
        },
        Roof {
            name: "gable with annexe",
            bodies: vec![gabled(d(0.0, 0.0), d(12.0, 8.0), 9.0, 38.0, true), flat(d(12.0, 1.0), d(17.0, 7.0), 4.0)],
        },
    ]
}
