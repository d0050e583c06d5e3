//! How friction passes over to the other direction about a recorded reversal.
//!
//! ```text
//! s(t) = −1 + 2 K((t − t₀)/w)
//! s(t) = −1 + 2 (v(t) − v₁)/(v₂ − v₁)
//!
//! moving mean  K(u) = u + ½ within ±½       one pole     K(u) = 1 − e^(−u)
//! two poles    K(u) = 1 − (1 + u) e^(−u)    Butterworth  K(u) = 1 − e^(−a) (cos a + sin a),  a = u/√2
//! zero phase   K(u) = ½ + ½ tanh u
//! ```
//! `K` is a filter's response to a step, `w` its width and `t₀` the true reversal. The recorded one is later by the mean delay of the filter:
//! the vertex of a smooth reversal, or the point at which the lines of two strokes at constant speed meet. Between constant speeds `v₁` and
//! `v₂` the direction passes any linear filter as the speed does, so that the filtered speed is the filtered direction.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// See the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Law {
    /// Within no time, later than the stroke by this, s; earlier where negative.
    Sharp(f64),
    /// Behind the reversal, by a time constant, s.
    AfterTime(f64),
    /// Behind the reversal, by a travel, m.
    AfterTravel(f64),
    /// Through any filter, between strokes at constant speed. The speed is that from the row before to the row this far ahead.
    AsSpeed(usize),
    /// Through a filter of this form.
    Filter {
        /// Its response to a step.
        kernel: Kernel,
        /// Its width, s.
        width: f64,
    },
}

/// A form of filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kernel {
    /// A moving average that is centred.
    Boxcar,
    /// First order.
    OnePole,
    /// Second order, critically damped.
    TwoPoles,
    /// Second order, with the flattest passband.
    Butterworth,
    /// Any filter that runs forwards and backwards.
    ZeroPhase,
}

impl Kernel {
    const ALL: [Self; 5] = [Self::Boxcar, Self::OnePole, Self::TwoPoles, Self::Butterworth, Self::ZeroPhase];

    /// The response to a step, `u` widths after it.
    fn response(self, u: f64) -> f64 {
        let after = u.max(0.0);
        match self {
            Self::Boxcar => (u + 0.5).clamp(0.0, 1.0),
            Self::OnePole => 1.0 - (-after).exp(),
            Self::TwoPoles => 1.0 - (1.0 + after) * (-after).exp(),
            Self::Butterworth => {
                let angle = after * FRAC_1_SQRT_2;
                1.0 - (-angle).exp() * (angle.cos() + angle.sin())
            }
            Self::ZeroPhase => 0.5 + 0.5 * u.tanh(),
        }
    }

    /// The mean delay, in widths.
    fn delay(self) -> f64 {
        match self {
            Self::Boxcar | Self::ZeroPhase => 0.0,
            Self::OnePole => 1.0,
            Self::TwoPoles => 2.0,
            Self::Butterworth => SQRT_2,
        }
    }
}

/// Where a row is about a recorded reversal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Time since the reversal, s; negative before it.
    pub time: f64,
    /// Travel since the reversal, m; zero before it.
    pub travel: f64,
    /// The change of the speed that is done, as a share of the whole.
    pub speed: f64,
}

impl Law {
    /// Every law without a filter of all channels, with these widths, s; travels are those at a speed, m/s.
    pub(super) fn unfiltered(widths: &[f64], speed: f64) -> Vec<Self> {
        let of =
            |w: &f64| [Self::Sharp(*w), Self::Sharp(-w), Self::AfterTime(*w), Self::AfterTravel(w * speed)];
        std::iter::once(Self::Sharp(0.0)).chain(widths.iter().flat_map(of)).collect()
    }

    /// Every law with one.
    pub(super) fn filters(widths: &[f64]) -> Vec<Self> {
        let of = |kernel: Kernel| widths.iter().map(move |width| Self::Filter { kernel, width: *width });
        let forms = Kernel::ALL.into_iter().flat_map(of);
        forms.chain([Self::AsSpeed(0), Self::AsSpeed(1)]).collect()
    }

    /// The same filter, wider by a factor.
    pub(super) fn widened(self, factor: f64) -> Option<Self> {
        if let Self::Filter { kernel, width } = self {
            Some(Self::Filter { kernel, width: factor * width })
        } else {
            None
        }
    }

    /// The share of a turn that is done at a row.
    pub(super) fn turned(self, place: Place) -> f64 {
        let Place { time, travel, speed } = place;
        let after = |u: f64| if time > 0.0 { 1.0 - (-u).exp() } else { 0.0 };
        match self {
            Self::Sharp(late) => f64::from(u8::from(time > late)),
            Self::AfterTime(over) => after(time / over),
            Self::AfterTravel(over) => after(travel / over),
            Self::AsSpeed(_) => speed,
            Self::Filter { kernel, width } => kernel.response(time / width + kernel.delay()),
        }
    }
}
