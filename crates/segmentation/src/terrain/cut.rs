//! Ground or object, decided for all cells at once by a minimum cut.
//!
//! What stands on the ground is closed in by steps up from the ground around it, on nearly all of its border; a terrace, a plaza or a
//! dam goes over into ground somewhere without a step, a court is closed in by steps down, and the rim of the scene is no step. Each
//! metre of border says a little; a car beside a wall, a ramp or a crown that leans on a roof says little against a whole outline.

use gable_graph_cut::{GridCapacities, max_flow_grid};

use super::cells::{Cells, Side};
use super::enclosure::{Enclosures, STEP};
use super::land::Land;
use crate::Error;

/// What borders and areas cost. Costs have no unit; only their ratios mean something. Those of borders are per metre.
///
/// Steps up to four metres are as likely in the ground (retaining walls, banks of stone) as on objects; higher ones stand on the
/// border of an object far more often.
struct Costs;

impl Costs {
    /// Ground over ground, for each metre of the step up to [`TALL_STEP`] and beyond it.
    const WALL_IN_GROUND: f32 = 0.11;
    const TALL_WALL_IN_GROUND: f32 = 0.03;
    /// Object over object, for each metre of the step, and at most.
    const WALL_IN_OBJECT: f32 = 0.1;
    const WALL_IN_OBJECT_AT_MOST: f32 = 0.2;
    /// On a hillside walls in the ground are common: the share by which they cost less there; by how much more those in objects cost
    /// at most; and what an object costs more for each m², for one that reaches over a whole hillside is none.
    const COMMON_ON_HILLSIDE: f32 = 0.55;
    const MORE_ON_HILLSIDE: f32 = 0.1;
    const OBJECT_ON_HILLSIDE: f32 = 0.006;
    /// An object that ends at the foot of higher ground, beyond both of the above.
    const OBJECT_BELOW_GROUND: f32 = 0.5;
    /// A border between ground and object without a step; less where the surface is steep.
    const NO_STEP: f32 = 2.5;
    const NO_STEP_WHERE_STEEP: f32 = 0.2;
    /// An object that the rim of the scene cuts.
    const RIM: f32 = 0.45;
    /// An object, for each m²: it decides where nothing else does.
    const OBJECT: f32 = 0.003;
    /// Ground that is rough within cells, as crowns are, for each m²; not in the low places of the land, where meadows are.
    const ROUGH_GROUND: f32 = 0.03;
    /// Ground that is nowhere even over several cells, as woods are, for each m².
    const UNEVEN_GROUND: f32 = 0.1;
}

/// Step from which ground over ground costs more only slowly, metres.
const TALL_STEP: f32 = 5.0;

/// Roughness within cells at which ground begins to cost, and at which it costs most, metres.
const ROUGH: [f32; 2] = [0.3, 0.6];

/// The same of unevenness over several cells, metres.
const UNEVEN: [f32; 2] = [0.12, 0.25];

/// Slope of the land (rise over run) from which a place begins to be a hillside, and is one.
const HILLSIDE: [f32; 2] = [0.1, 0.35];

/// Height over the low places of the land at which a place begins to be none of them, and is none, metres.
const LOW_PLACE: [f32; 2] = [1.5, 3.5];

/// By how much more the ground of a hillside may stand over its plane, metres.
const HILLSIDE_RELIEF: f32 = 2.5;

/// Steep rise from which a border counts as a step, metres.
const STEP_FROM: f32 = 0.5 * STEP;

/// Costs are cut as whole numbers of this fraction.
const SCALE: f32 = 1000.0;

/// Marks the objects among the usable cells. `land` is how it lies at large, `against_ground` are more costs of a cell's being ground (see
/// [`super::doubt::against_ground`]). O(cells) in practice.
///
/// # Errors
/// If the cut refuses its input; it cannot, for all costs are bounded.
pub(super) fn objects(
    cells: &Cells,
    usable: &[bool],
    enclosures: &Enclosures,
    land: &Land,
    against_ground: &[f32],
) -> Result<Vec<bool>, Error> {
    let count = usable.len();
    let (width, height) = (cells.window.width, cells.window.height);
    let edge = cells.window.step as f32;
    // Cost of object less that of ground.
    let mut object = vec![0.0_f32; count];
    // Cost of "this one is ground, the one on that side is an object".
    let [mut right, mut left, mut up, mut down] = [(); 4].map(|()| vec![0_i32; count]);
    for i in (0..count).filter(|&i| usable[i]) {
        let rough = Costs::ROUGH_GROUND * ramp(cells.rough[i], ROUGH);
        let uneven = Costs::UNEVEN_GROUND * ramp(cells.uneven[i], UNEVEN);
        let hillside = ramp(land.slope(i), HILLSIDE);
        let no_low_place = ramp(land.over_low_places[i] - HILLSIDE_RELIEF * hillside, LOW_PLACE);
        let on_hillside = Costs::OBJECT_ON_HILLSIDE * hillside;
        object[i] += (Costs::OBJECT + on_hillside - rough.max(uneven) * no_low_place) * edge * edge - against_ground[i];
        for side in Side::ALL {
            let Some((j, rise)) = cells.beside(i, side).filter(|(j, _)| usable[*j]) else {
                object[i] += Costs::RIM * edge;
                continue;
            };
            // Each pair once, from its upper cell.
            if rise > 0.0 || (rise == 0.0 && j < i) {
                continue;
            }
            let pair = pair(cells, enclosures, hillside, i, j, -rise);
            object[i] += edge * (pair.only_upper - pair.none);
            object[j] += edge * (pair.both - pair.only_upper);
            let capacity = edge * (pair.only_lower + pair.only_upper - pair.none - pair.both);
            let to = match side {
                Side::East => &mut right,
                Side::West => &mut left,
                Side::North => &mut up,
                Side::South => &mut down,
            };
            to[i] = whole(capacity);
        }
    }
    let terminal: Vec<i32> = object.iter().map(|cost| whole(*cost)).collect();
    let capacities =
        GridCapacities { width, height, terminal: &terminal, right: &right, left: &left, up: &up, down: &down };
    let (_, objects) = max_flow_grid(capacities).map_err(|e| Error::GraphCut(e.to_string()))?;
    Ok(objects.into_iter().zip(usable).map(|(object, usable)| object && *usable).collect())
}

/// Costs of a metre of border between two cells, by which of them is an object.
struct Pair {
    none: f32,
    only_upper: f32,
    only_lower: f32,
    both: f32,
}

fn pair(cells: &Cells, enclosures: &Enclosures, hillside: f32, upper: usize, lower: usize, step: f32) -> Pair {
    if step <= STEP_FROM {
        let slope = (cells.middle[upper] - cells.middle[lower]).abs() / cells.window.step as f32;
        let change = Costs::NO_STEP * (1.2 - slope).clamp(Costs::NO_STEP_WHERE_STEEP, 1.0);
        return Pair { none: 0.0, only_upper: change, only_lower: change, both: 0.0 };
    }
    let is_inner = step >= STEP && enclosures.encloses(upper, lower);
    let none = if is_inner { 0.0 } else { wall_in_ground(step) * (1.0 - Costs::COMMON_ON_HILLSIDE * hillside) };
    let both = (Costs::WALL_IN_OBJECT * step).min(Costs::WALL_IN_OBJECT_AT_MOST + Costs::MORE_ON_HILLSIDE * hillside);
    Pair { none, only_upper: 0.0, only_lower: none + both + Costs::OBJECT_BELOW_GROUND, both }
}

/// Cost of a metre of a step in the ground of some height, metres.
pub(super) fn wall_in_ground(step: f32) -> f32 {
    Costs::WALL_IN_GROUND * step.min(TALL_STEP) + Costs::TALL_WALL_IN_GROUND * (step - TALL_STEP).max(0.0)
}

/// From 0 to 1 between two values.
fn ramp(value: f32, [from, to]: [f32; 2]) -> f32 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

fn whole(cost: f32) -> i32 {
    (cost * SCALE).round() as i32
}
