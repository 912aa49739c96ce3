//! What a case is given: numbers by name, so that each can be moved by an ulp.

/// Names of the numbers.
#[derive(Clone, Copy)]
#[allow(dead_code, reason = "some are named as the first of three only")]
pub enum Key {
    /// Degrees.
    FrontTilt,
    FrontSwing,
    /// Millimetres.
    FrontRise,
    FrontShift,
    RearTilt,
    RearSwing,
    RearRise,
    RearShift,
    Extension,
    Focal,
    Number,
    /// Circle of confusion, metres; or a distance.
    C,
    /// A point in metres: of an object, of a wanted plane, or the first of three.
    Px,
    Py,
    Pz,
    /// A second point; or the wanted plane's normal.
    Qx,
    Qy,
    Qz,
    /// A third point.
    Rx,
    Ry,
    Rz,
    /// Lens point in fractions of the aperture's radius.
    U,
    V,
    /// The camera's eye, what it looks at, and up; world, metres.
    EyeX,
    EyeY,
    EyeZ,
    AtX,
    AtY,
    AtZ,
    UpX,
    UpY,
    UpZ,
}

pub const COUNT: usize = Key::UpZ as usize + 1;

#[derive(Clone, Debug)]
pub struct Input(pub [f64; COUNT]);

impl Input {
    /// A 150 mm lens at f/5.6 focused at 10 m, at the world's origin; the object is a point 10 m away.
    pub fn base() -> Self {
        let zero = Self([0.0; COUNT]);
        zero.with(Key::Extension, 152.25)
            .with(Key::Focal, 150.0)
            .with(Key::Number, 5.6)
            .with(Key::C, 1e-4)
            .at(Key::Px, [0.5, -0.25, -10.0])
            .at(Key::Qx, [0.0, 0.0, 1.0])
            .with(Key::U, 0.75)
            .with(Key::V, -0.5)
            .with(Key::AtZ, -1.0)
            .with(Key::UpY, 1.0)
    }

    pub fn with(mut self, key: Key, value: f64) -> Self {
        self.0[key as usize] = value;
        self
    }

    /// Sets three numbers from `key` on.
    pub fn at(mut self, key: Key, value: [f64; 3]) -> Self {
        self.0[key as usize..key as usize + 3].copy_from_slice(&value);
        self
    }

    pub fn tilts(self, front: f64, rear: f64) -> Self {
        self.with(Key::FrontTilt, front).with(Key::RearTilt, rear)
    }

    pub fn get(&self, key: Key) -> f64 {
        self.0[key as usize]
    }

    pub fn three(&self, key: Key) -> [f64; 3] {
        [0, 1, 2].map(|i| self.0[key as usize + i])
    }
}
