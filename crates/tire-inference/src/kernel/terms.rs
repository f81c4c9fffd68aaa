//! Computes the Magic Formula around one slip once and for all: value and derivatives, for plain numbers, for the vectors of the
//! processor, and for numbers that carry derivatives.
//!
//! With u = Bx, a = atan u, v = u − E(u − a), w = atan v, φ = Cw and S = DC cos φ / (1 + v²), the derivatives of y = D sin φ are
//! y_D = sin φ, y_C = D w cos φ, y_E = −S(u − a), y_x = S B p and y_B = S x p with p = 1 − E + E/(1 + u²).

use numerics::scalar::Scalar;

/// What value and derivatives are made of, without shifts. What is not used costs nothing: everything is inlined.
pub struct MagicFormulaTerms<T> {
    /// Slip.
    pub x: T,
    /// Parameters.
    pub B: T,
    pub C: T,
    pub D: T,
    /// B x.
    pub u: T,
    /// u − atan u.
    pub bend: T,
    /// u − E bend.
    pub v: T,
    /// atan v.
    pub w: T,
    /// Of C w.
    pub sin: T,
    pub cos: T,
    /// 1/(1 + u²) and 1/(1 + v²).
    pub narrow: T,
    pub flat: T,
    /// dv/du.
    pub p: T,
    /// E.
    pub E: T,
}

impl<T: Scalar> MagicFormulaTerms<T> {
    /// Of a slip.
    #[inline(always)]
    pub fn new([B, C, D, E]: [T; 4], x: T) -> Self {
        let u = B * x;
        let bend = u - u.atan();
        let v = u - E * bend;
        let w = v.atan();
        let (sin, cos) = (C * w).sin_cos();
        // One division instead of two.
        let (uu, vv) = (u * u + 1.0, v * v + 1.0);
        let both = (uu * vv).recip();
        let (narrow, flat) = (vv * both, uu * both);
        let p = -E + 1.0 + E * narrow;
        Self { x, B, C, D, u, bend, v, w, sin, cos, narrow, flat, p, E }
    }

    /// Friction coefficient.
    #[inline(always)]
    pub fn value(&self) -> T {
        self.D * self.sin
    }

    /// S, the derivative by v.
    #[inline(always)]
    pub fn by_v(&self) -> T {
        self.D * self.C * self.cos * self.flat
    }

    /// The derivatives by B, C, D, E and the slip.
    #[inline(always)]
    pub fn gradient(&self) -> [T; 5] {
        let S = self.by_v();
        let by_u = S * self.p;
        [by_u * self.x, self.D * self.w * self.cos, self.sin, -(S * self.bend), by_u * self.B]
    }

    /// The second derivative by u: p_u S + p² S_v, where p_u = −2Eu/(1 + u²)² and S_v = −DC(C sin φ + 2v cos φ)/(1 + v²)².
    #[inline(always)]
    pub fn second_by_u(&self) -> T {
        let p_u = -(self.E * self.u * self.narrow * self.narrow * 2.0);
        p_u * self.by_v() + self.p * self.p * self.second_by_v()
    }

    /// S_v.
    #[inline(always)]
    fn second_by_v(&self) -> T {
        let turn = self.C * self.sin + self.v * self.cos * 2.0;
        -(self.D * self.C * self.flat * self.flat * turn)
    }

    /// The derivatives of the slope over the slip by B, C, D, E and the slip. With G = pS the slope is BG; S_C =
    /// D (cos φ − φ sin φ)/(1 + v²), p_E = −u²/(1 + u²).
    #[inline(always)]
    pub fn gradient_of_slope(&self) -> [T; 5] {
        let Self { B, C, D, u, bend, w, sin, cos, narrow, flat, p, .. } = *self;
        let (S, S_by_v, G_by_u) = (self.by_v(), self.second_by_v(), self.second_by_u());
        [
            p * S + u * G_by_u,
            B * p * D * flat * (cos - C * w * sin),
            B * p * (C * cos * flat),
            -(B * (S_by_v * bend * p + S * u * u * narrow)),
            B * B * G_by_u,
        ]
    }
}
