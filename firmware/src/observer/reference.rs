//! The grid in f64 by Runge-Kutta steps of 1 ms: the truth that the observer's tests compare with.

fn slope(x: [f64; 4], fleet_gw: f64, loss_gw: f64) -> [f64; 4] {
    let [f, g, l, p] = x;
    let g_dot = (-5.0 * f - g) / 2.5;
    [
        (p + fleet_gw - loss_gw - f) / 8.0,
        g_dot,
        (g + 2.0 * g_dot - l) / 12.0,
        (l - p) / 0.5,
    ]
}

/// The state (f, g, l, p) after this many milliseconds under constant powers \[GW\].
pub(crate) fn advance(mut x: [f64; 4], ms: u32, fleet_gw: f64, loss_gw: f64) -> [f64; 4] {
    let h = 1e-3;
    let along = |x: [f64; 4], k: [f64; 4], h: f64| {
        let mut moved = x;
        for (value, slope) in moved.iter_mut().zip(k) {
            *value += h * slope;
        }
        moved
    };
    for _ in 0..ms {
        let k1 = slope(x, fleet_gw, loss_gw);
        let k2 = slope(along(x, k1, h / 2.0), fleet_gw, loss_gw);
        let k3 = slope(along(x, k2, h / 2.0), fleet_gw, loss_gw);
        let k4 = slope(along(x, k3, h), fleet_gw, loss_gw);
        for axis in 0..4 {
            x[axis] += h / 6.0 * (k1[axis] + 2.0 * k2[axis] + 2.0 * k3[axis] + k4[axis]);
        }
    }
    x
}
