//! What cameras see: for each place the height above which a camera in a direction sees free space.
//!
//! A ray from a place towards a camera far away passes over the neighbour at a height that grows by
//! the tangent of its elevation, so the horizon is a running maximum against the direction of view:
//! horizon(i) = max(top(i+1), horizon(i+1)) − drop. One pass for each direction.

/// A field of heights, row by row.
pub(crate) struct Heights {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<f32>,
}

/// Horizon towards one of the four sides: `side` 0 is +x, 1 −x, 2 +y, 3 −y. `drop` is how much the ray
/// falls from one place to the next, metres.
pub(crate) fn horizon(top: &Heights, side: usize, drop: f32) -> Vec<f32> {
    let (w, h) = (top.width, top.height);
    let mut out = vec![f32::NEG_INFINITY; w * h];
    let place = |row: usize, k: usize| match side {
        0 => row * w + (w - 1 - k),
        1 => row * w + k,
        2 => (h - 1 - k) * w + row,
        _ => k * w + row,
    };
    let (rows, length) = if side < 2 { (h, w) } else { (w, h) };
    for row in 0..rows {
        let mut level = f32::NEG_INFINITY;
        for k in 0..length {
            let i = place(row, k);
            out[i] = level;
            level = level.max(top.data[i]) - drop;
        }
    }
    out
}

/// Horizon towards a direction on the ground (unit), with interpolation between neighbours, so that
/// its border is soft: the height above which the sun shines. `rise` is the tangent of the elevation.
pub(crate) fn directed_horizon(top: &Heights, direction: [f32; 2], rise: f32, pitch: f32) -> Vec<f32> {
    let (w, h) = (top.width, top.height);
    let [dx, dy] = direction;
    let along_x = dx.abs() >= dy.abs();
    let (major, minor) = if along_x { (dx, dy) } else { (dy, dx) };
    let slant = minor / major.abs();
    let drop = rise * pitch * (1.0 + slant * slant).sqrt();
    let (length, breadth) = if along_x { (w, h) } else { (h, w) };
    let place = |k: usize, m: usize| if along_x { m * w + k } else { k * w + m };
    let mut out = vec![f32::NEG_INFINITY; w * h];
    for step in 1..length {
        let (k, from) = if major > 0.0 { (length - 1 - step, length - step) } else { (step, step - 1) };
        for m in 0..breadth {
            let s = (m as f32 + slant).clamp(0.0, breadth as f32 - 1.0);
            let (a, f) = (s.floor() as usize, s.fract());
            let b = (a + 1).min(breadth - 1);
            let level = |m: usize| out[place(from, m)].max(top.data[place(from, m)]).max(-1e6);
            out[place(k, m)] = level(a) * (1.0 - f) + level(b) * f - drop;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_throws_its_horizon() {
        let mut top = Heights { width: 20, height: 3, data: vec![0.0; 60] };
        for j in 0..3 {
            top.data[j * 20 + 10] = 5.0;
        }
        let east = horizon(&top, 0, 1.0);
        assert_eq!((east[20 + 9], east[20 + 6], east[20 + 4]), (4.0, 1.0, -1.0));
        assert_eq!(east[20 + 12], -1.0);
        let sun = directed_horizon(&top, [1.0, 0.0], 2.0, 0.5);
        assert_eq!((sun[20 + 9], sun[20 + 6], sun[20 + 10]), (4.0, 1.0, -1.0));
    }
}
