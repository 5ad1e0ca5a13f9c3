//! The ground of a place, with what is already taken of it.

use super::builder::Builder;
use super::house::Form;
use super::landform::pad::Pad;
use super::plot::Plot;
use super::primitive::Oblong;
use gable_geometry::{Counter, DVec2, dvec2};
use std::sync::Arc;

/// Tries to find room for something.
const TRIES: usize = 40;
/// Houses on ground that is steeper than this stand on pads, metres per metre.
const LEVEL: f64 = 0.08;

/// A site that is built on.
pub(crate) struct Site {
    pub(crate) town: Builder,
    plot: Plot,
    /// What landforms have taken, and others may not build on.
    pub(crate) reserved: Vec<Oblong>,
    /// The direction that most things follow.
    pub(crate) axis: DVec2,
}

impl Site {
    pub(crate) fn new(town: Builder, c: &mut Counter) -> Self {
        let (low, high) = (town.extent.min, town.extent.max);
        let ring = vec![low, dvec2(high.x, low.y), high, dvec2(low.x, high.y)];
        // On a slope, houses and roads follow the contour lines.
        let (uphill, slope) = town.relief.tilt();
        let drawn = DVec2::from_angle(c.range(0.0, std::f64::consts::PI));
        let axis = if slope > LEVEL { DVec2::from_angle(c.range(-0.2, 0.2)).rotate(uphill.perp()) } else { drawn };
        Self { town, plot: Plot::new(ring), reserved: Vec::new(), axis }
    }

    pub(crate) fn size(&self) -> DVec2 {
        self.town.extent.size()
    }

    pub(crate) fn middle(&self) -> DVec2 {
        (self.town.extent.min + self.town.extent.max) / 2.0
    }

    /// Area, m².
    pub(crate) fn area(&self) -> f64 {
        self.size().x * self.size().y
    }

    /// A place anywhere.
    pub(crate) fn anywhere(&self, c: &mut Counter) -> DVec2 {
        self.town.extent.min + self.size() * dvec2(c.unit(), c.unit())
    }

    /// A strip through the whole site along its axis, `off` half sizes from its middle.
    pub(crate) fn strip(&self, off: f64, half_width: f64, c: &mut Counter) -> Oblong {
        let axis = DVec2::from_angle(c.range(-0.25, 0.25)).rotate(self.axis);
        let half = self.size() / 2.0;
        let across = half.x * axis.perp().x.abs() + half.y * axis.perp().y.abs();
        let half_length = half.x * axis.x.abs() + half.y * axis.y.abs() + 8.0;
        Oblong { centre: self.middle() + axis.perp() * (off * across), axis, half_length, half_width }
    }

    /// Takes ground for good.
    pub(crate) fn reserve(&mut self, plan: Oblong) {
        self.reserved.push(plan);
        self.plot.take(plan.ring());
    }

    /// Takes ground.
    pub(crate) fn take(&mut self, plan: &Oblong) {
        self.plot.take(plan.ring());
    }

    /// Whether a plan is free, `gap` metres from what is there.
    pub(crate) fn is_free(&self, plan: &Oblong, gap: f64) -> bool {
        self.plot.is_free(&plan.ring(), 2.0, gap)
    }

    /// Whether a landform has taken a place.
    pub(crate) fn is_reserved(&self, p: DVec2) -> bool {
        self.reserved.iter().any(|plan| plan.contains(p))
    }

    /// Free ground for an oblong along the site's axis or across it.
    pub(crate) fn find(&self, half_length: f64, half_width: f64, gap: f64, c: &mut Counter) -> Option<Oblong> {
        for _ in 0..TRIES {
            let centre = self.anywhere(c);
            let turned = if c.unit() < 0.5 { self.axis } else { self.axis.perp() };
            let axis = DVec2::from_angle(c.range(-0.15, 0.15)).rotate(turned);
            let plan = Oblong { centre, axis, half_length, half_width };
            if self.is_free(&plan, gap) {
                return Some(plan);
            }
        }
        None
    }

    /// A house where the ground is free; on slopes mostly on a pad. Says whether it was built.
    pub(crate) fn house(
        &mut self,
        form: Form,
        plan: &Oblong,
        eave: f64,
        slope: f64,
        gap: f64,
        c: &mut Counter,
    ) -> bool {
        if !self.is_free(plan, gap) || !self.town.fits(&plan.ring()) {
            return false;
        }
        let heights = plan.ring().into_iter().map(|p| self.town.relief.height(p));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        let before = self.town.relief.clone();
        if high - low > LEVEL * 2.0 * plan.half_width && c.unit() < 0.7 {
            let apron = c.range(0.8, 3.0);
            let grown = Oblong { half_length: plan.half_length + apron, half_width: plan.half_width + apron, ..*plan };
            let level = low + (high - low) * c.range(0.2, 0.6);
            self.town.relief.add(Arc::new(Pad { plan: grown, level }));
        }
        let built = self.town.house(form, plan, eave, slope, c);
        if built {
            self.take(plan);
        } else {
            self.town.relief = before;
        }
        built
    }
}
