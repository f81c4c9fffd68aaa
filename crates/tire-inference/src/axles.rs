//! Indexes values by axle, front and rear.

use std::ops::{Index, IndexMut};

use serde::Serialize;

/// One of both axles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axle {
    /// In front.
    Front,
    /// In the rear.
    Rear,
}

impl Axle {
    /// Both, the front one first.
    pub const ALL: [Self; 2] = [Self::Front, Self::Rear];

    /// The other one.
    pub fn opposite(self) -> Self {
        match self {
            Self::Front => Self::Rear,
            Self::Rear => Self::Front,
        }
    }
}

/// A thing for each of both axles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Axles<T> {
    /// Of the front axle.
    pub front: T,
    /// Of the rear axle.
    pub rear: T,
}

impl<T> Axles<T> {
    /// What a function gives for each axle.
    pub fn from_fn(mut of: impl FnMut(Axle) -> T) -> Self {
        Self { front: of(Axle::Front), rear: of(Axle::Rear) }
    }

    /// Something of each.
    pub fn map<U>(self, mut of: impl FnMut(T) -> U) -> Axles<U> {
        Axles { front: of(self.front), rear: of(self.rear) }
    }

    /// By reference.
    pub fn each_ref(&self) -> Axles<&T> {
        Axles { front: &self.front, rear: &self.rear }
    }

    /// The front one, then the rear one.
    pub fn into_array(self) -> [T; 2] {
        [self.front, self.rear]
    }
}

impl<T> From<[T; 2]> for Axles<T> {
    fn from([front, rear]: [T; 2]) -> Self {
        Self { front, rear }
    }
}

impl<T> Index<Axle> for Axles<T> {
    type Output = T;

    fn index(&self, axle: Axle) -> &T {
        match axle {
            Axle::Front => &self.front,
            Axle::Rear => &self.rear,
        }
    }
}

impl<T> IndexMut<Axle> for Axles<T> {
    fn index_mut(&mut self, axle: Axle) -> &mut T {
        match axle {
            Axle::Front => &mut self.front,
            Axle::Rear => &mut self.rear,
        }
    }
}
