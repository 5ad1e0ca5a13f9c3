//! The rows: small places, each with one thing more than the town has. What is not said here is drawn from the seed.

/// A place and how it is sensed.
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) quarter: &'static str,
    pub(super) with: &'static str,
    pub(super) seed: u64,
    /// Side of its square, metres.
    pub(super) side: f64,
    /// Slope of the ground, metres per metre.
    pub(super) slope: f64,
    /// Faces for each m².
    pub(super) density: f64,
    /// Edge of a mesh tile, metres.
    pub(super) tile: f64,
    /// Edge of a texel, metres.
    pub(super) texel: f64,
    pub(super) cast: &'static str,
    pub(super) season: &'static str,
}

const fn row(name: &'static str, quarter: &'static str, with: &'static str, seed: u64) -> Row {
    Row {
        name,
        quarter,
        with,
        seed,
        side: 140.0,
        slope: 0.04,
        density: 5.0,
        tile: 80.0,
        texel: 0.1,
        cast: "1,1,1",
        season: "summer",
    }
}

/// Coarse meshes are one tile: at borders of tiles with few faces the surface would part.
const fn sensed(name: &'static str, quarter: &'static str, seed: u64, density: f64, texel: f64) -> Row {
    let row = row(name, quarter, "", seed);
    Row { density, texel, tile: if density < 3.0 { 400.0 } else { 60.0 }, ..row }
}

/// All rows, in the order of the table.
pub(super) const ROWS: &[Row] = &[
    row("village", "village", "", 21),
    Row { slope: 0.02, side: 200.0, ..row("farm", "farm", "", 22) },
    row("campus", "campus", "", 23),
    Row { side: 180.0, ..row("industry", "industry", "", 24) },
    Row { side: 180.0, ..row("high-rise", "high-rise", "", 25) },
    Row { side: 240.0, density: 2.0, tile: 400.0, ..row("open", "open", "", 26) },
    Row { slope: 0.3, ..row("terraces", "village", "terraces", 31) },
    Row { slope: 0.45, side: 100.0, ..row("terraces 45 %", "village", "terraces,hedges,bananas", 32) },
    Row { slope: 0.3, side: 160.0, ..row("slope 30 %", "village", "", 33) },
    row("embankment", "village", "embankment", 34),
    Row { side: 100.0, slope: 0.01, ..row("court", "campus", "court", 35) },
    row("pond", "village", "pond", 36),
    Row { slope: 0.01, ..row("quay", "town", "quay", 37) },
    row("cutting", "village", "cutting", 38),
    row("bridge", "town", "bridge", 39),
    Row { slope: 0.01, ..row("stairs", "campus", "stairs", 40) },
    Row { density: 1.0, tile: 400.0, ..row("grove", "village", "grove", 41) },
    Row { side: 180.0, density: 0.75, tile: 400.0, ..row("wood", "open", "grove", 42) },
    Row { side: 180.0, ..row("crops", "farm", "crops", 43) },
    row("bananas and palms", "village", "bananas,palms", 44),
    row("hedges", "village", "hedges", 45),
    Row { side: 180.0, density: 2.0, tile: 400.0, ..row("rim", "farm", "rim", 51) },
    Row { side: 100.0, ..row("rim small", "industry", "rim", 52) },
    row("holes", "village", "holes", 53),
    row("pits", "industry", "pits", 54),
    Row { side: 100.0, slope: 0.0, ..row("pits small", "campus", "pits", 55) },
    row("fill", "village", "fill", 56),
    row("sheets", "village", "sheets", 61),
    row("tarpaulins", "village", "tarpaulins", 62),
    row("glass hall", "campus", "glass-hall", 63),
    row("minarets and stacks", "village", "minarets,stacks", 64),
    row("pergolas", "campus", "pergolas", 65),
    row("green roofs", "campus", "green-roofs", 66),
    Row { side: 100.0, ..row("battered walls", "open", "battered", 67) },
    row("eaves", "village", "eaves", 68),
    Row { side: 220.0, density: 3.0, ..row("long hall", "industry", "long-hall", 69) },
    sensed("0.05 faces per m²", "town", 71, 0.05, 0.3),
    sensed("0.25 faces per m²", "town", 72, 0.25, 0.1),
    sensed("1 face per m²", "village", 73, 1.0, 0.1),
    Row { side: 80.0, tile: 40.0, ..sensed("30 faces per m² and texels 2 cm", "village", 74, 30.0, 0.02) },
    sensed("texels 0.5 m", "village", 75, 3.0, 0.5),
    sensed("texels 2 m", "village", 76, 3.0, 2.0),
    Row { cast: "1.15,1,0.78", ..sensed("warm cast", "village", 77, 3.0, 0.1) },
    Row { cast: "0.72,0.86,1.02", ..sensed("cold cast", "village", 78, 3.0, 0.1) },
    Row { season: "spring", ..sensed("spring", "village", 79, 3.0, 0.1) },
    Row { season: "drought", ..sensed("drought", "village", 80, 3.0, 0.1) },
    Row { season: "autumn", ..sensed("autumn", "village", 81, 3.0, 0.1) },
    Row { season: "winter", ..sensed("winter", "village", 82, 3.0, 0.1) },
    Row { season: "snow", ..sensed("snow", "village", 83, 3.0, 0.1) },
    row("all drawn 1", "any", "", 91),
    row("all drawn 2", "any", "", 92),
    row("all drawn 3", "any", "", 93),
    row("all drawn 4", "any", "", 94),
];
