use super::*;
use crate::{PlainColours, Texture, WallEvidence};
use gable_geometry::Counter;
use gable_raster::Raster;
use proptest::prelude::*;
use std::sync::Arc;

/// One texture for all materials.
struct OneTexture(Arc<Texture>);

impl TextureSource for OneTexture {
    fn texture(&self, _material: u32) -> Option<Arc<Texture>> {
        Some(self.0.clone())
    }

    fn colour(&self, _material: u32) -> [u8; 3] {
        [128; 3]
    }
}

fn lattice(v: f64) -> i32 {
    (v * gable_blocks::UNITS_PER_METRE).round() as i32
}

fn triangle(corners: [[f64; 3]; 3]) -> BlockTriangle {
    BlockTriangle { corners: corners.map(|c| c.map(lattice)), ..Default::default() }
}

/// Triangles of all sizes and slopes, some duplicated, some on the pixel lattice.
fn soup(seed: u64, count: usize) -> BlockMesh {
    let mut rng = Counter::new(seed);
    let mut triangles: Vec<BlockTriangle> = Vec::new();
    for i in 0..count {
        let size = if i % 7 == 0 { 6.0 } else { 0.8 };
        let at = [rng.range(-6.0, 6.0), rng.range(-6.0, 6.0), rng.range(0.0, 4.0)];
        let mut corner = || {
            let mut c = at.map(|v| v + size * rng.range(-0.5, 0.5));
            if i % 5 == 0 {
                c = [(c[0] * 5.0).round() / 5.0 + 0.1, (c[1] * 5.0).round() / 5.0 + 0.1, c[2].round()];
            }
            c
        };
        let mut t = triangle([corner(), corner(), corner()]);
        t.material = i as u32 % 3;
        t.colours = [[i as u8, (i / 2) as u8, 7, 255]; 3];
        t.uv = std::array::from_fn(|_| [rng.unit() as f32, rng.unit() as f32]);
        triangles.push(t);
        if i % 11 == 0 {
            t.material += 1;
            triangles.push(t);
        }
    }
    BlockMesh { triangles }
}

fn texture() -> OneTexture {
    let mut rng = Counter::new(2);
    let texels = (0..64 * 32).map(|_| std::array::from_fn(|_| rng.bits() as u8)).collect();
    OneTexture(Arc::new(Texture::new(64, 32, texels).unwrap()))
}

fn window() -> GridWindow {
    GridWindow { step: 0.2, x0: -25, y0: -30, width: 55, height: 61 }
}

fn assert_same(a: &Orthograph, b: &Orthograph) {
    assert!(a.height.values().iter().zip(b.height.values()).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert_eq!(a.colour, b.colour);
    assert_eq!(a.photographed, b.photographed);
    assert_eq!(a.normal, b.normal);
    assert_eq!(a.walls, b.walls);
}

#[test]
fn agrees_with_a_vertical_ray_through_every_triangle() {
    let mesh = soup(1, 300);
    let sampled = sample(&mesh, window(), &PlainColours([128; 3]), &SampleParams::default());
    let mut hits = 0;
    for row in 0..window().height {
        for column in 0..window().width {
            let p = window().centre(column, row);
            let mut best = f64::NEG_INFINITY;
            let mut unsure = false;
            for t in &mesh.triangles {
                let [a, b, c] = t.positions();
                let d = (b - a).truncate().perp_dot((c - a).truncate());
                if d == 0.0 {
                    continue;
                }
                let side = |a: DVec3, b: DVec3| (b - a).truncate().perp_dot(p - a.truncate()) / d;
                let weights = [side(b, c), side(c, a), side(a, b)];
                let least = weights.into_iter().fold(f64::INFINITY, f64::min);
                // Rounding may decide what touches a centre: that is tested by its own test.
                unsure |= least.abs() < 1e-9;
                if least >= 0.0 {
                    best = best.max(weights[0] * a.z + weights[1] * b.z + weights[2] * c.z);
                }
            }
            let h = f64::from(sampled.height[(column, row)]);
            if !unsure {
                assert_eq!(h.is_nan(), best == f64::NEG_INFINITY, "at {column}, {row}");
                assert!(h.is_nan() || (h - best).abs() < 1e-4, "{h} is not {best} at {column}, {row}");
                hits += usize::from(!h.is_nan());
            }
        }
    }
    assert!(hits > 1500, "the scene covers too little: {hits}");
}

#[test]
fn does_not_depend_on_order_window_or_threads() {
    let mesh = soup(4, 2000);
    let textures = texture();
    let params = SampleParams::default();
    let whole = sample(&mesh, window(), &textures, &params);

    let mut shuffled = mesh.clone();
    let mut rng = Counter::new(9);
    for i in (1..shuffled.triangles.len()).rev() {
        shuffled.triangles.swap(i, rng.index(i + 1));
    }
    assert_same(&sample(&shuffled, window(), &textures, &params), &whole);

    let mut mosaic = Orthograph::empty(window());
    for (x, y) in [(0, 0), (13, 0), (0, 40), (13, 40)] {
        let part = GridWindow {
            x0: window().x0 + x,
            y0: window().y0 + y,
            width: if x == 0 { 13 } else { 42 },
            height: if y == 0 { 40 } else { 21 },
            ..window()
        };
        let part = sample(&mesh, part, &textures, &params);
        assert_same(&part, &whole.crop(part.window()));
        mosaic.paste(&part);
    }
    assert_same(&mosaic, &whole);

    let tall = GridWindow { y0: -150, height: 300, ..window() };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sample(&mesh, tall, &textures, &params))
    };
    assert_same(&run(1), &run(3));
}

#[test]
fn a_closed_surface_has_no_cracks() {
    // A fan of triangles with corners and edges on pixel centres and a ragged rim.
    let mut rng = Counter::new(3);
    let rim: Vec<_> = (0..40)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 40.0).sin_cos();
            let r = rng.range(5.2, 5.8);
            [0.1 + r * cos, 0.1 + r * sin, 1.0]
        })
        .collect();
    let triangles = (0..40).map(|i| triangle([[0.1, 0.1, 3.0], rim[i], rim[(i + 1) % 40]])).collect();
    let sampled = sample(&BlockMesh { triangles }, window(), &PlainColours([128; 3]), &SampleParams::default());
    for row in 0..window().height {
        for column in 0..window().width {
            if window().centre(column, row).distance(DVec2::splat(0.1)) < 5.0 {
                assert!(sampled.height[(column, row)] > 1.0);
            }
        }
    }
}

#[test]
fn textures_lie_the_right_way_round() {
    // Upper left red, upper right green, lower left blue, lower right white.
    let texels = (0..8)
        .flat_map(|y| (0..8).map(move |x| [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255; 3]]][y / 4][x / 4]))
        .collect();
    let textures = OneTexture(Arc::new(Texture::new(8, 8, texels).unwrap()));
    let corners = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [4.0, 4.0, 1.0], [0.0, 4.0, 1.0]];
    let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0f32]];
    let part = |i: [usize; 3]| BlockTriangle { uv: i.map(|i| uv[i]), ..triangle(i.map(|i| corners[i])) };
    let mesh = BlockMesh { triangles: vec![part([0, 1, 2]), part([2, 3, 0])] };
    let window = GridWindow { step: 0.2, x0: 0, y0: 0, width: 20, height: 20 };
    let sampled = sample(&mesh, window, &textures, &SampleParams::default());
    assert_eq!(sampled.colour[(2, 17)], [255, 0, 0], "row 17 is in the north");
    assert_eq!(sampled.colour[(17, 17)], [0, 255, 0]);
    assert_eq!(sampled.colour[(2, 2)], [0, 0, 255]);
    assert_eq!(sampled.colour[(17, 2)], [255; 3]);
    assert_eq!(sampled.coverage(), (400, 400));
    assert!(sampled.walls.values().iter().all(|w| *w == WallEvidence::default()));
}

#[test]
fn the_highest_surface_wins_and_walls_below_it_count() {
    let square = |z: f64, r: f64| {
        let c = [[-r, -r, z], [r, -r, z], [r, r, z], [-r, r, z]];
        [triangle([c[0], c[1], c[2]]), triangle([c[2], c[3], c[0]])]
    };
    let wall = [
        triangle([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, -1.0, 3.0]]),
        triangle([[-1.0, -1.0, 0.0], [1.0, -1.0, 3.0], [-1.0, -1.0, 3.0]]),
    ];
    let mut triangles = [square(0.0, 4.0), wall].concat();
    triangles.extend(square(3.0, 1.5));
    let sampled = sample(&BlockMesh { triangles }, window(), &PlainColours([128; 3]), &SampleParams::default());
    let height = |x: f64, y: f64| *sampled.height.at(DVec2::new(x, y)).unwrap();
    assert_eq!((height(0.0, 0.0), height(1.45, 0.0), height(1.75, 0.0)), (3.0, 3.0, 0.0));
    assert!(height(5.0, 0.0).is_nan());
    assert_eq!(*sampled.normal.at(DVec2::ZERO).unwrap(), [0.0, 0.0, 1.0]);
    let area: f32 = sampled.walls.values().iter().map(|w| w.area).sum();
    assert!((area - 6.0).abs() < 1e-3, "{area}");
    assert_eq!(sampled.coverage().1, 0);
    let empty: Raster<f32> =
        sample(&BlockMesh::default(), window(), &PlainColours([128; 3]), &SampleParams::default()).height;
    assert!(empty.values().iter().all(|h| h.is_nan()));
}

proptest! {
    #[test]
    fn nonsense_does_not_panic(
        corners in prop::array::uniform3(prop::array::uniform3(any::<i32>())),
        uv in prop::array::uniform3(prop::array::uniform2(any::<f32>())),
        near in any::<bool>(),
        step in 0.05..40.0f64,
    ) {
        let corners = if near { corners.map(|c| c.map(|v| v >> 14)) } else { corners };
        let mesh = BlockMesh { triangles: vec![BlockTriangle { corners, uv, ..Default::default() }] };
        let window = GridWindow { step, ..window() };
        let sampled = sample(&mesh, window, &texture(), &SampleParams::default());
        let (low, high) = (corners.map(|c| c[2]).into_iter().min(), corners.map(|c| c[2]).into_iter().max());
        let metres = |v: Option<i32>| (f64::from(v.unwrap()) / gable_blocks::UNITS_PER_METRE) as f32;
        for &h in sampled.height.values() {
            prop_assert!(h.is_nan() || (metres(low)..=metres(high)).contains(&h));
        }
        for w in sampled.walls.values() {
            prop_assert!(w.area.is_finite() && w.z_min <= w.z_max);
        }
    }
}
