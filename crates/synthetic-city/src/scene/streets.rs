//! Streets that divide a town into convex blocks of all sizes, by cuts that are rarely parallel: first the wide ones, then
//! the narrow ones between them, so that most crossings are T-shaped, as in towns that have grown.

use super::plot::{Plot, around};
use super::primitive::{Oblong, clip};
use gable_geometry::{Counter, DVec2, ring_area};

/// Blocks below this area are not divided, m²; most are larger.
const SMALLEST: f64 = 1_500.0;

/// A street with its carriageway; footways lie beside it.
#[derive(Clone, Copy)]
pub(crate) struct Street {
    /// Carriageway.
    pub(crate) plan: Oblong,
    /// Width of each footway, metres.
    pub(crate) footway: f64,
    /// Whether a canal runs along its middle.
    pub(crate) canal: bool,
}

/// What streets leave.
#[derive(Default)]
pub(crate) struct Network {
    pub(crate) streets: Vec<Street>,
    /// Convex blocks, counter-clockwise, with the width of the footway around them.
    pub(crate) blocks: Vec<(Vec<DVec2>, f64)>,
}

/// Divides a convex ring.
pub(crate) fn network(ring: Vec<DVec2>, c: &mut Counter) -> Network {
    let mut network = Network::default();
    let canal = ring_area(&ring) > 80_000.0;
    divide(ring, canal, 2.0, c, &mut network);
    network
}

fn divide(ring: Vec<DVec2>, canal: bool, footway: f64, c: &mut Counter, out: &mut Network) {
    let area = ring_area(&ring);
    // Few blocks are large; most have 3,000 to 6,000 m².
    let wanted = 2_600.0 + 3_400.0 * c.unit() + if c.unit() < 0.12 { 6_000.0 } else { 0.0 };
    if area > wanted.max(2.0 * SMALLEST) {
        for _ in 0..6 {
            let wide = area > 60_000.0;
            let half = if canal {
                c.range(10.5, 12.0)
            } else if wide {
                c.range(6.5, 9.0)
            } else {
                c.range(3.6, 5.6)
            };
            let footway = if wide || canal { c.range(2.4, 3.4) } else { c.range(1.3, 2.2) };
            if let Some((parts, street)) = cut(&ring, half, footway, canal, c) {
                out.streets.push(street);
                let [one, other] = parts;
                divide(one, false, footway, c, out);
                divide(other, false, footway, c, out);
                return;
            }
        }
    }
    out.blocks.push((ring, footway));
}

/// Two parts beside a street across the longer extent of a ring, or nothing if one of them is too small or too narrow.
fn cut(ring: &[DVec2], half: f64, footway: f64, canal: bool, c: &mut Counter) -> Option<([Vec<DVec2>; 2], Street)> {
    let plot = Plot::new(ring.to_vec());
    let whole = around(ring, plot.longest()?.along);
    let (long, length) = if whole.half_length >= whole.half_width {
        (whole.axis, whole.half_length)
    } else {
        (whole.axis.perp(), whole.half_width)
    };
    let lean = if c.unit() < 0.35 { c.range(-2.0, 2.0) } else { c.range(-15.0, 15.0) };
    let across = DVec2::from_angle(lean.to_radians()).rotate(long);
    let through = whole.centre + long * (length * c.range(-0.3, 0.3));
    let parts = [1.0, -1.0].map(|side| clip(ring, |p| side * across.dot(p - through) - half));
    for part in &parts {
        if part.len() < 3 || ring_area(part) < SMALLEST {
            return None;
        }
        let narrow = Plot::new(part.clone())
            .fronts()
            .iter()
            .any(|f| f.length < 14.0 || part.iter().map(|p| f.depth(*p)).fold(0.0, f64::max) < 26.0);
        if narrow {
            return None;
        }
    }
    let axis = across.perp();
    let strip = clip(&clip(ring, |p| across.dot(p - through) + half), |p| half - across.dot(p - through));
    let strip = around(&strip, axis);
    // On to the middle of the streets where it ends.
    let plan = Oblong { half_width: half - footway, half_length: strip.half_length + 4.0, ..strip };
    Some((parts, Street { plan, footway, canal }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn blocks_are_convex_apart_and_of_many_sizes() {
        let ring = vec![dvec2(0.0, 0.0), dvec2(400.0, 0.0), dvec2(400.0, 400.0), dvec2(0.0, 400.0)];
        let network = network(ring, &mut Counter::new(3));
        let areas: Vec<f64> = network.blocks.iter().map(|(b, _)| ring_area(b)).collect();
        assert!(areas.len() > 15 && areas.iter().all(|a| *a >= SMALLEST), "{areas:?}");
        let (least, most) = areas.iter().fold((f64::MAX, 0.0_f64), |(l, m), a| (l.min(*a), m.max(*a)));
        assert!(most > 2.0 * least, "{least} to {most}");
        for (n, (block, _)) in network.blocks.iter().enumerate() {
            let plot = Plot::new(block.clone());
            assert!(block.iter().all(|p| plot.holds(*p, -1e-6)), "convex");
            for (other, _) in &network.blocks[n + 1..] {
                assert!(!plot.holds(Plot::new(other.clone()).middle(), 0.0));
            }
        }
        assert_eq!(network.streets.len() + 1, network.blocks.len());
    }
}
