//! A real scene made ready for measuring: what a person says of each pixel, and the surface of the mesh there.

use super::judged_labels::Label;
use super::judged_objects::roofprint;
use super::outlines::{Outline, OutlineClass, Outlines};
use crate::Error;
use crate::height_raster::{HeightRaster, NONE};
use crate::region::Ring;
use gable_city_model::CityModel;
use gable_geometry::{Box2, DVec2, DVec3, dvec2};

/// Edges of pixels, the finest that does not need more than [`MOST_PIXELS`], metres.
const STEPS: [f64; 5] = [0.1, 0.2, 0.4, 0.8, 1.6];

/// Memory is 30 bytes for each.
const MOST_PIXELS: f64 = 6e6;

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    /// Outside of the judged area, or without a surface.
    Nothing,
    /// In no polygon: no building.
    NotDrawn,
    /// In a polygon.
    Drawn(OutlineClass),
}

/// Truth and surface on the pixels of a lattice.
#[derive(Debug)]
pub struct RealScene {
    pub(crate) outlines: Outlines,
    /// The highest surface; tags are the numbers of the triangles.
    pub(crate) surface: HeightRaster,
    pub(crate) known: Vec<Known>,
    /// For pixels of buildings, the number of the polygon; else [`NONE`].
    pub(crate) polygon: Vec<u32>,
}

impl RealScene {
    /// Draws the triangles of the mesh and the polygons, both in the frame of the mesh, metres, z up. Linear in both and in the pixels.
    ///
    /// # Errors
    /// If mesh and judged area do not meet.
    pub fn new(outlines: Outlines, triangles: &[[DVec3; 3]]) -> Result<Self, Error> {
        let mesh = Box2::of(triangles.iter().flatten().map(|p| p.truncate()));
        let areas: Vec<&Outline> = outlines.of_class(OutlineClass::Area).collect();
        let judged = Box2::of(areas.iter().flat_map(|o| o.rings.iter().flatten()).map(|&p| DVec2::from(p)));
        let bounds = match areas[..] {
            [] => mesh,
            _ => Box2 { min: mesh.min.max(judged.min), max: mesh.max.min(judged.max) },
        };
        let mut scene = Self::surface(outlines, bounds, triangles)?;
        let Self { outlines, surface, known, polygon } = &mut scene;
        for (number, outline) in outlines.outlines.iter().enumerate().filter(|o| o.1.class != OutlineClass::Area) {
            fill(surface, &outline.rings, |at| {
                known[at] = Known::Drawn(outline.class);
                polygon[at] = if outline.building.is_some() { number as u32 } else { NONE };
            });
        }
        let no_area = outlines.of_class(OutlineClass::Area).next().is_none();
        let mut inside = vec![no_area; known.len()];
        for area in outlines.of_class(OutlineClass::Area) {
            fill(surface, &area.rings, |at| inside[at] = true);
        }
        for at in (0..known.len()).filter(|&at| !inside[at] || surface.tag[at] == NONE) {
            (known[at], polygon[at]) = (Known::Nothing, NONE);
        }
        Ok(scene)
    }

    /// A made scene, of which everything is known: its buildings, and by `class` what is uppermost at each place of the frame of the mesh,
    /// `None` where nothing is to be judged. Roofs end at the walls in `truth` and at the eaves in `class`: between the two, and where a
    /// crown is over a roof, either answer is right.
    ///
    /// # Errors
    /// If the mesh is empty, or too large.
    pub fn made(
        truth: &CityModel,
        class: &dyn Fn(DVec2) -> Option<OutlineClass>,
        triangles: &[[DVec3; 3]],
    ) -> Result<Self, Error> {
        let shift = DVec3::from_array(truth.origin);
        let mut outlines = Outlines::default();
        for building in &truth.buildings {
            let rings: Vec<Ring> = roofprint(building, shift).rings().cloned().collect();
            outlines.add_building(building.id.clone(), rings);
        }
        let bounds = Box2::of(triangles.iter().flatten().map(|p| p.truncate()));
        let mut scene = Self::surface(outlines, bounds, triangles)?;
        let Self { outlines, surface, polygon, .. } = &mut scene;
        for (number, outline) in outlines.outlines.iter().enumerate() {
            fill(surface, &outline.rings, |at| polygon[at] = number as u32);
        }
        for at in 0..scene.known.len() {
            let class = if scene.surface.tag[at] == NONE { None } else { class(scene.centre(at)) };
            let roof = scene.polygon[at] != NONE;
            scene.known[at] = match class {
                None => Known::Nothing,
                Some(OutlineClass::Building) if roof => Known::Drawn(OutlineClass::Building),
                Some(other) if !roof && other != OutlineClass::Building => Known::Drawn(other),
                Some(_) => Known::Drawn(OutlineClass::Unsure),
            };
            if scene.known[at] != Known::Drawn(OutlineClass::Building) {
                scene.polygon[at] = NONE;
            }
        }
        Ok(scene)
    }

    /// The surface of a mesh; nothing is drawn yet.
    fn surface(outlines: Outlines, bounds: Box2, triangles: &[[DVec3; 3]]) -> Result<Self, Error> {
        if bounds.is_empty() {
            return Err(Error::Apart);
        }
        let pixels = |step: f64| bounds.size().x * bounds.size().y / (step * step);
        let step = STEPS.into_iter().find(|&s| pixels(s) <= MOST_PIXELS).ok_or(Error::TooLarge)?;
        let mut surface = HeightRaster::covering(bounds, step);
        for (number, triangle) in triangles.iter().enumerate() {
            surface.draw(*triangle, number as u32);
        }
        let (known, polygon) = (vec![Known::NotDrawn; surface.tag.len()], vec![NONE; surface.tag.len()]);
        Ok(Self { outlines, surface, known, polygon })
    }

    /// Edge of a pixel, metres.
    #[must_use]
    pub fn step(&self) -> f64 {
        self.surface.step
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.surface.width, self.surface.height]
    }

    /// South-western corner, metres in the frame of the mesh.
    #[must_use]
    pub fn corner(&self) -> DVec2 {
        dvec2(self.surface.x0 as f64, self.surface.y0 as f64) * self.surface.step
    }

    /// The label that a person gives each pixel, row by row from the south; `None` where there is none.
    pub fn labels(&self) -> impl Iterator<Item = Option<Label>> + '_ {
        self.known.iter().map(|known| match known {
            Known::Drawn(OutlineClass::Building) => Some(Label::Building),
            Known::Drawn(OutlineClass::Tree) => Some(Label::Tree),
            Known::Drawn(OutlineClass::Grass) => Some(Label::Grass),
            Known::Drawn(OutlineClass::Ground) => Some(Label::Ground),
            _ => None,
        })
    }

    /// For each pixel with a surface, row by row from the south: its number, its centre, and the number of the triangle on top.
    pub fn tops(&self) -> impl Iterator<Item = (usize, DVec2, usize)> + '_ {
        let with_surface = (0..self.known.len()).filter(|&at| self.surface.tag[at] != NONE);
        with_surface.map(|at| (at, self.centre(at), self.surface.tag[at] as usize))
    }

    /// Centre of a pixel.
    pub(crate) fn centre(&self, at: usize) -> DVec2 {
        let r = &self.surface;
        let (column, row) = (at % r.width, at / r.width);
        dvec2((r.x0 + column as i64) as f64 + 0.5, (r.y0 + row as i64) as f64 + 0.5) * r.step
    }

    /// Area of a number of pixels, m².
    pub(crate) fn area(&self, pixels: usize) -> f64 {
        pixels as f64 * self.step() * self.step()
    }
}

/// Visits the pixels whose centre is inside of a polygon (an odd number of its rings' sides is west of it). Linear in sides ×
/// rows that they cross, and in the pixels.
pub(crate) fn fill(raster: &HeightRaster, rings: &[Ring], mut visit: impl FnMut(usize)) {
    // Where sides cross the middle line of each row, in pixels from the middle of the first column.
    let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); raster.height];
    let place = |p: [f64; 2]| DVec2::from(p) / raster.step - dvec2(raster.x0 as f64 + 0.5, raster.y0 as f64 + 0.5);
    for ring in rings {
        for k in 0..ring.len() {
            let (a, b) = (place(ring[k]), place(ring[(k + 1) % ring.len()]));
            let first = a.y.min(b.y).ceil().max(0.0);
            let last = a.y.max(b.y).min(raster.height as f64);
            let mut row = first;
            // A side holds its lower end, not its upper one, so that each corner counts once.
            while row < last {
                crossings[row as usize].push(a.x + (b.x - a.x) * ((row - a.y) / (b.y - a.y)));
                row += 1.0;
            }
        }
    }
    for (row, mut along) in crossings.into_iter().enumerate() {
        along.sort_unstable_by(f64::total_cmp);
        for pair in along.chunks_exact(2) {
            let first = pair[0].ceil().max(0.0) as usize;
            let end = pair[1].ceil().clamp(0.0, raster.width as f64) as usize;
            for column in first..end {
                visit(row * raster.width + column);
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::outlines::tests::{collection, rectangle};
    use super::*;
    use crate::region::Region;
    use gable_geometry::Counter;

    /// Two triangles over a rectangle at a height that rises to the east.
    pub(crate) fn slab([x0, y0, x1, y1]: [f64; 4], z: f64, rise: f64) -> [[DVec3; 3]; 2] {
        let corner = |x: f64, y: f64| dvec2(x, y).extend(z + rise * (x - x0));
        let [a, b, c, d] = [corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)];
        [[a, b, c], [a, c, d]]
    }

    #[test]
    fn filled_pixels_are_those_whose_centre_is_inside() {
        let mut random = Counter::new(5);
        let raster = HeightRaster::covering(Box2 { min: dvec2(-2.0, 1.0), max: dvec2(8.0, 9.0) }, 0.25);
        for _ in 0..50 {
            let mut ring =
                |n: usize| -> Ring { (0..n).map(|_| [random.range(-4.0, 10.0), random.range(-1.0, 11.0)]).collect() };
            let rings = vec![ring(7), ring(3)];
            let mut filled = vec![0; raster.tag.len()];
            fill(&raster, &rings, |at| filled[at] += 1);
            for (at, count) in filled.into_iter().enumerate() {
                let (x, y) = ((at % raster.width) as f64, (at / raster.width) as f64);
                let p = dvec2(raster.x0 as f64 + x + 0.5, raster.y0 as f64 + y + 0.5) * 0.25;
                let sides = rings.iter().flat_map(|r| (0..r.len()).map(move |k| (r[k], r[(k + 1) % r.len()])));
                let west = sides.filter(|&([ax, ay], [bx, by])| {
                    (ay > p.y) != (by > p.y) && ax + (bx - ax) * (p.y - ay) / (by - ay) < p.x
                });
                assert_eq!(count, west.count() % 2, "{p}");
            }
        }
        let hole = [
            vec![[0.0, 2.0], [4.0, 2.0], [4.0, 6.0], [0.0, 6.0]],
            vec![[1.0, 3.0], [3.0, 3.0], [3.0, 5.0], [1.0, 5.0]],
        ];
        let mut count = 0;
        fill(&raster, &hole, |_| count += 1);
        assert_eq!(f64::from(count) / 16.0, Region::of([hole.to_vec()]).area().round());
    }

    #[test]
    fn later_polygons_lie_on_earlier_ones_inside_of_area_and_mesh() {
        let outlines = collection(&[
            rectangle("area", "", [0.0, 0.0, 8.0, 4.0]),
            rectangle("ground", "", [-5.0, -5.0, 20.0, 20.0]),
            rectangle("building", "a", [1.0, 1.0, 3.0, 3.0]),
            rectangle("unsure", "", [2.0, 0.0, 4.0, 4.0]),
        ]);
        let scene = RealScene::new(outlines, &slab([0.0, 0.0, 6.0, 10.0], 1.0, 0.0)).unwrap();
        assert_eq!((scene.step(), scene.size()), (0.1, [60, 40]));
        let count = |what: Known| scene.known.iter().filter(|k| **k == what).count();
        assert_eq!(count(Known::Drawn(OutlineClass::Building)), 200);
        assert_eq!(count(Known::Drawn(OutlineClass::Unsure)), 800);
        assert_eq!(count(Known::Drawn(OutlineClass::Ground)), 1400);
        assert_eq!(scene.polygon.iter().filter(|p| **p == 2).count(), 200);
        assert!((scene.area(200) - 2.0).abs() < 1e-12);
        let (_, centre, top) = scene.tops().last().unwrap();
        assert!((centre - dvec2(5.95, 3.95)).length() < 1e-9 && top < 2);
    }

    #[test]
    fn of_a_made_scene_all_is_known_but_what_eaves_and_crowns_hide() {
        use gable_city_model::{Attributes, Building, Face, Lods, Semantic, Shell};
        let corners = [(2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)];
        let roof = Shell {
            vertices: corners.map(|(x, y)| dvec2(x, y).extend(3.0)).to_vec(),
            faces: vec![Face {
                rings: vec![vec![0, 1, 2, 3]],
                semantic: Semantic::RoofSurface,
                attributes: Attributes::new(),
            }],
        };
        let lods = Lods { roof_edge: Some(roof), ..Lods::default() };
        let building = Building { id: "a".to_owned(), attributes: Attributes::new(), lods };
        let truth = CityModel {
            title: String::new(),
            metadata: Default::default(),
            origin: [100.0, 0.0, 0.0],
            crs: gable_geometry::Crs::Unknown,
            buildings: vec![building],
            terrain: None,
        };
        // The roof with an eave of a metre in the east; a crown over its western metre; a hole in the north.
        let class = |p: DVec2| match () {
            () if p.y > 8.0 => None,
            () if (102.0..103.0).contains(&p.x) => Some(OutlineClass::Tree),
            () if (103.0..107.0).contains(&p.x) && (2.0..6.0).contains(&p.y) => Some(OutlineClass::Building),
            () => Some(OutlineClass::Ground),
        };
        let scene = RealScene::made(&truth, &class, &slab([100.0, 0.0, 110.0, 10.0], 1.0, 0.0)).unwrap();
        let area = |what: Known| scene.area(scene.known.iter().filter(|k| **k == what).count()).round();
        assert_eq!(area(Known::Drawn(OutlineClass::Building)), 12.0);
        assert_eq!(area(Known::Drawn(OutlineClass::Unsure)), 4.0 + 4.0);
        assert_eq!(area(Known::Drawn(OutlineClass::Tree)), 4.0);
        assert_eq!((area(Known::Nothing), area(Known::NotDrawn)), (20.0, 0.0));
        assert_eq!(scene.polygon.iter().filter(|p| **p == 0).count(), 1200);
        assert!(matches!(RealScene::made(&truth, &class, &[]), Err(Error::Apart)));
    }

    #[test]
    fn a_mesh_beside_the_judged_area_is_refused() {
        let far = collection(&[rectangle("area", "", [100.0, 0.0, 108.0, 4.0])]);
        assert!(matches!(RealScene::new(far, &slab([0.0, 0.0, 6.0, 10.0], 1.0, 0.0)), Err(Error::Apart)));
        assert!(matches!(RealScene::new(Outlines::default(), &[]), Err(Error::Apart)));
        let huge = slab([0.0, 0.0, 1e5, 1e5], 1.0, 0.0);
        assert!(matches!(RealScene::new(Outlines::default(), &huge), Err(Error::TooLarge)));
    }
}
