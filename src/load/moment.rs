//! Moments of an animation: which animations, at what time, and how long the shutter is open.

use std::fmt;

/// Which animations of a file are played.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnimationChoice {
    /// One by its place.
    Index(usize),
    /// One by its name; of several of one name the first.
    Name(String),
    /// All at once; where two move one thing, the first does.
    All,
}

impl Default for AnimationChoice {
    fn default() -> Self {
        Self::Index(0)
    }
}

impl fmt::Display for AnimationChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Index(index) => write!(f, "{index}"),
            Self::Name(name) => write!(f, "\"{name}\""),
            Self::All => write!(f, "all"),
        }
    }
}

/// Where the time that the shutter is open lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShutterPosition {
    /// It opens at the frame's time.
    Start,
    /// It is open as long before the frame's time as after it.
    #[default]
    Center,
    /// It closes at the frame's time.
    End,
}

/// A frame of an animation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Seconds from the animation's beginning.
    pub time: f64,
    /// From one frame to the next, seconds.
    pub frame_seconds: f64,
    /// Share of that for which the shutter is open, in [0, 1]; `None` = as the file's cameras say, else 0.
    pub shutter: Option<f64>,
    /// Where that lies.
    pub position: ShutterPosition,
}

impl Moment {
    /// When a shutter that is open for `share` of a frame opens and closes, seconds.
    pub fn interval(&self, share: f64) -> [f64; 2] {
        let open = share * self.frame_seconds;
        let before = match self.position {
            ShutterPosition::Start => 0.0,
            ShutterPosition::Center => 0.5 * open,
            ShutterPosition::End => open,
        };
        [self.time - before, self.time - before + open]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shutter_lies_where_it_is_asked_to() {
        let moment = |position| Moment { time: 2.0, frame_seconds: 0.25, shutter: None, position };
        assert_eq!(moment(ShutterPosition::Start).interval(0.5), [2.0, 2.125]);
        assert_eq!(moment(ShutterPosition::Center).interval(0.5), [1.9375, 2.0625]);
        assert_eq!(moment(ShutterPosition::End).interval(1.0), [1.75, 2.0]);
        assert_eq!(moment(ShutterPosition::End).interval(0.0), [2.0, 2.0]);
    }
}
