//! Frames of animations: which are asked for, and the moments that they stand for.

use crate::load::{AnimationChoice, LoadOptions, Moment, ShutterPosition, animation_seconds};
use std::path::Path;
use std::str::FromStr;

/// Frames of each file's animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// Which.
    pub choice: FrameChoice,
    /// Frames a second, above 0: frame f is at f / fps.
    pub fps: f64,
    /// Of which animation.
    pub animation: AnimationChoice,
    /// Share of a frame that the shutter is open, in [0, 1]; `None` = as the file says, else 0.
    pub shutter: Option<f64>,
    /// Where that lies.
    pub position: ShutterPosition,
}

/// Which frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameChoice {
    /// From 0 to the one at or after the last key.
    All,
    /// These, in this order, each once.
    List(Vec<u32>),
}

impl FrameChoice {
    /// The highest number of a frame: a day at 1000 frames a second fits.
    pub const MOST: u32 = 99_999_999;
    /// The most frames of a run.
    const MOST_FRAMES: usize = 1_000_000;
}

impl FromStr for FrameChoice {
    type Err = String;

    /// `all`, `7`, `1-24`, `1-100x2`, and lists of the last three with commas between.
    fn from_str(text: &str) -> Result<Self, String> {
        const ALLOWED: &str = "must be all, or frames such as 12, 1-24, 1-100x2 (every second one) or 1,5,9-20, each \
                               from 0 to 99999999 and at most 1000000 of them";
        if text == "all" {
            return Ok(Self::All);
        }
        let number = |text: &str| -> Result<u32, String> {
            let digits = text.trim();
            let is_plain = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
            let found = digits.parse().ok().filter(|n| is_plain && *n <= Self::MOST);
            found.ok_or_else(|| ALLOWED.to_owned())
        };
        let mut frames = Vec::new();
        for part in text.split(',') {
            let (range, step) = match part.split_once('x') {
                None => (part, 1),
                Some((range, step)) => (range, number(step)?),
            };
            let (first, last) = match range.split_once('-') {
                None => (number(range)?, number(range)?),
                Some((first, last)) => (number(first)?, number(last)?),
            };
            if first > last {
                return Err(format!("{first}-{last} ends before it begins; {ALLOWED}"));
            }
            if step == 0 {
                return Err(format!("a step of 0 goes nowhere; {ALLOWED}"));
            }
            if ((last - first) / step) as usize + frames.len() >= Self::MOST_FRAMES {
                return Err(ALLOWED.to_owned());
            }
            frames.extend((first..=last).step_by(step as usize));
        }
        let mut seen = std::collections::HashSet::new();
        frames.retain(|frame| seen.insert(*frame));
        Ok(Self::List(frames))
    }
}

impl Frames {
    /// The numbers of the frames of `path`; frame 0 alone of a file without animation, and of one that cannot be read,
    /// which will say so itself.
    pub fn numbers(&self, path: &Path, options: &LoadOptions) -> Vec<u32> {
        match &self.choice {
            FrameChoice::List(frames) => frames.clone(),
            FrameChoice::All => {
                let seconds = animation_seconds(path, options, &self.animation).unwrap_or(0.0);
                (0..=last_frame(seconds, self.fps)).collect()
            }
        }
    }

    /// The moment of a frame.
    pub fn moment(&self, frame: u32) -> Moment {
        Moment {
            time: f64::from(frame) / self.fps,
            frame_seconds: self.fps.recip(),
            shutter: self.shutter,
            position: self.position,
        }
    }
}

/// The first frame at or after a time, the 32-bit number of a key.
fn last_frame(seconds: f64, fps: f64) -> u32 {
    let frames = seconds * fps;
    // A key that was written for a frame is off by what f32 rounds, which must not make another frame.
    let nearest = frames.round();
    let last = if (nearest / fps) as f32 == seconds as f32 { nearest } else { frames.ceil() };
    last.clamp(0.0, FrameChoice::MOST_FRAMES as f64) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_listed_in_the_order_typed_each_once() {
        let list = |frames: &[u32]| Ok(FrameChoice::List(frames.to_vec()));
        assert_eq!("all".parse(), Ok(FrameChoice::All));
        assert_eq!("7".parse(), list(&[7]));
        assert_eq!("1-4".parse(), list(&[1, 2, 3, 4]));
        assert_eq!("1-10x3".parse(), list(&[1, 4, 7, 10]));
        assert_eq!("9, 1,3-5,4".parse(), list(&[9, 1, 3, 4, 5]));
        assert_eq!("0-0".parse(), list(&[0]));
        for text in ["", "-1", "5-1", "1-", "x", "1-9x0", "1.5", "1,,2", "100000000", "0-1000000", "+3", "All"] {
            let why = text.parse::<FrameChoice>().unwrap_err();
            assert!(why.contains("1-100x2"), "{text}: {why}");
        }
    }

    #[test]
    fn all_ends_with_the_frame_of_the_last_key() {
        for fps in [24.0, 25.0, 29.97, 30.0, 60.0, 1000.0] {
            for frame in 0..500 {
                let key = f64::from((f64::from(frame) / fps) as f32);
                assert_eq!(last_frame(key, fps), frame, "at {fps} a second");
            }
        }
        assert_eq!(last_frame(1.01, 24.0), 25);
        assert_eq!(last_frame(0.0, 24.0), 0);
    }
}
