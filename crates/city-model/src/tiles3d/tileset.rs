//! Tilesets: quadtrees over the tiles of the city, in each leaf the levels of detail from coarse to fine.

use gable_geometry::DVec3;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// A level of a tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerLevel {
    /// Name of the content's file, relative to the tileset.
    pub uri: String,
    /// How far it is from the finest level, metres.
    pub error: f64,
    /// Lowest corner of a box that holds it, local metres.
    pub low: DVec3,
    /// Highest corner.
    pub high: DVec3,
}

/// A tile of a layer, its levels from coarse to fine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Column and row of the tile.
    pub tile: [u32; 2],
    /// The levels, errors falling.
    pub levels: Vec<LayerLevel>,
}

/// What is shown of a square of the grid from afar, in place of its tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// The square's lowest column and row.
    pub corner: [u32; 2],
    /// Its side, tiles; as [`quadtree`] gives both.
    pub side: u32,
    /// What is shown; its error is larger than any of the tiles'.
    pub level: LayerLevel,
}

/// The tiles of a layer, with what stands for many of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileLayer<'a> {
    /// The tiles.
    pub tiles: &'a [Layer],
    /// For some of the squares that hold several tiles.
    pub overviews: &'a [Overview],
}

/// What a tileset says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct TilesetHeader {
    /// Title.
    pub title: String,
    /// Reference system of the world coordinates.
    pub crs: String,
    /// World coordinates of the local origin, metres.
    pub origin: [f64; 3],
    /// From local to Earth-centred coordinates, if that is known.
    pub transform: Option<[f64; 16]>,
}

/// A tileset of several layers, one beside the other, each an explicit quadtree over its tiles.
///
/// Inner tiles have an overview, which is replaced by what is below, or no content; then they are refined by ADD, their geometric error
/// being the diagonal of what they hold, which is missing as long as they are not refined. Levels of a tile replace one another. Errors
/// never rise from parent to child. A layer without a tile is left out; a tileset without any has an empty root.
#[must_use]
pub fn write_tileset(header: &TilesetHeader, layers: &[TileLayer<'_>]) -> Vec<u8> {
    let trees: Vec<Node> = layers.iter().filter_map(tree).collect();
    let root = match <[Node; 1]>::try_from(trees) {
        Ok([tree]) => tree,
        Err(trees) => Node::over(trees),
    };
    // As long as the root is not there, all is missing.
    let error = root.error.max(root.low.distance(root.high));
    let mut tile = root.json();
    if let Some(transform) = header.transform {
        tile["transform"] = json!(transform);
    }
    let tileset = json!({
        "asset": {
            "version": "1.1",
            "extras": { "title": header.title, "crs": header.crs, "origin": header.origin, "generator": "gable" },
        },
        "geometricError": error,
        "root": tile,
    });
    tileset.to_string().into_bytes()
}

/// A tile of a tileset.
struct Node {
    low: DVec3,
    high: DVec3,
    error: f64,
    content: Option<String>,
    children: Vec<Self>,
}

impl Node {
    /// A tile without content around others.
    fn over(children: Vec<Self>) -> Self {
        let bounds = children.iter().map(|c| (c.low, c.high));
        let (low, high) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
        let error = children.iter().map(|c| c.error).fold(low.distance(high), f64::max);
        Self { low, high, error, content: None, children }
    }

    /// The levels of a tile, each the parent of the next finer one.
    fn levels(levels: &[LayerLevel]) -> Option<Self> {
        let (first, finer) = levels.split_first()?;
        let children: Vec<Self> = Self::levels(finer).into_iter().collect();
        let error = if children.is_empty() { 0.0 } else { first.error };
        let low = children.iter().fold(first.low, |l, c| l.min(c.low));
        let high = children.iter().fold(first.high, |h, c| h.max(c.high));
        let error = children.iter().map(|c| c.error).fold(error, f64::max);
        Some(Self { low, high, error, content: Some(first.uri.clone()), children })
    }

    fn json(&self) -> Value {
        let (centre, half) = ((self.low + self.high) / 2.0, (self.high - self.low) / 2.0);
        let [x, y, z] = half.to_array();
        let mut tile = json!({
            "boundingVolume": { "box": [centre.x, centre.y, centre.z, x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z] },
            "geometricError": self.error,
            "refine": if self.content.is_some() { "REPLACE" } else { "ADD" },
        });
        if let Some(uri) = &self.content {
            tile["content"] = json!({ "uri": uri });
        }
        if !self.children.is_empty() {
            tile["children"] = self.children.iter().map(Self::json).collect();
        }
        tile
    }
}

/// The quadtree over the tiles of a layer.
fn tree(layer: &TileLayer<'_>) -> Option<Node> {
    let tiles: Vec<_> = layer.tiles.iter().map(|l| (l.tile, l)).collect();
    let mut inner = |corner: [u32; 2], side: u32, children: Vec<Node>| {
        let mut node = Node::over(children);
        if let Some(overview) = layer.overviews.iter().find(|o| (o.corner, o.side) == (corner, side)) {
            let level = &overview.level;
            (node.low, node.high) = (node.low.min(level.low), node.high.max(level.high));
            node.error = node.children.iter().map(|c| c.error).fold(level.error, f64::max);
            node.content = Some(level.uri.clone());
        }
        Some(node)
    };
    quadtree(&tiles, &mut |l: &&Layer| Node::levels(&l.levels), &mut inner)
}

/// Folds the quadtree over the tiles of a grid: `leaf` makes something of a tile, `inner` of a square of the grid, by its lowest corner
/// and its side, from what came of its quarters. A square with one such part only is that part.
///
/// # Examples
/// ```
/// use gable_city_model::tiles3d::quadtree;
///
/// let tiles = [([0, 0], "a"), ([1, 0], "b"), ([3, 3], "c")];
/// let inner = &mut |corner: [u32; 2], side: u32, parts: Vec<String>| Some(format!("{corner:?}+{side}({})", parts.join(" ")));
/// let found = quadtree(&tiles, &mut |name: &&str| Some((*name).to_owned()), inner);
/// assert_eq!(found.unwrap(), "[0, 0]+4([0, 0]+2(a b) c)");
/// ```
pub fn quadtree<L, T>(
    tiles: &[([u32; 2], L)],
    leaf: &mut impl FnMut(&L) -> Option<T>,
    inner: &mut impl FnMut([u32; 2], u32, Vec<T>) -> Option<T>,
) -> Option<T> {
    let far = tiles.iter().flat_map(|(tile, _)| *tile).max()?;
    quadrant(&tiles.iter().collect::<Vec<_>>(), [0, 0], (far + 1).next_power_of_two(), leaf, inner)
}

fn quadrant<L, T>(
    tiles: &[&([u32; 2], L)],
    [x, y]: [u32; 2],
    side: u32,
    leaf: &mut impl FnMut(&L) -> Option<T>,
    inner: &mut impl FnMut([u32; 2], u32, Vec<T>) -> Option<T>,
) -> Option<T> {
    if tiles.is_empty() {
        return None;
    }
    if side == 1 {
        return tiles.iter().find_map(|(_, l)| leaf(l));
    }
    let half = side / 2;
    let mut parts = Vec::new();
    for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
        let corner = [x + dx, y + dy];
        let inside = |tile: &[u32; 2]| (0..2).all(|i| (corner[i]..corner[i] + half).contains(&tile[i]));
        let inside: Vec<&([u32; 2], L)> = tiles.iter().filter(|(tile, _)| inside(tile)).copied().collect();
        parts.extend(quadrant(&inside, corner, half, leaf, inner));
    }
    match <[T; 1]>::try_from(parts) {
        Ok([only]) => Some(only),
        Err(parts) if parts.is_empty() => None,
        Err(parts) => inner([x, y], side, parts),
    }
}
