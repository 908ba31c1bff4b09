use super::*;
use crate::film::{Film, TILE, Tile, TileSums};

/// What a film says after `spp` samples that are 1 or, with a share of `bright`, 1 + `height`: noise of known strength.
fn errors(spp: u32, height: f32, bright: u32) -> Errors {
    let mut film = Film::new(Tile { x: 0, y: 0, width: 64, height: 64 }, TILE);
    let wave = film.wave(spp);
    for i in 0..wave.units() {
        let (tile, samples) = wave.unit(i);
        let mut sums = TileSums::new(&tile, &samples);
        for pixel in 0..tile.area() as u32 {
            for sample in samples.clone() {
                let mut mixed = (i as u32 % 4) << 26 | pixel << 16 | sample;
                for k in [0x7feb_352d_u32, 0x846c_a68b, 0x9e37_79b9] {
                    mixed = (mixed ^ mixed >> 16).wrapping_mul(k);
                }
                sums.add(pixel, sample, [if mixed >> 26 < bright { 1.0 + height } else { 1.0 }; 3]);
            }
        }
        wave.store(i, &sums);
    }
    film.take(wave);
    film.errors(&film.mean()).unwrap()
}

/// Where waves end, each of which takes `pace` seconds a sample, and what ended them; `look` is what the film says.
fn run(mut waves: Waves, pace: f64, look: impl Fn(u32) -> Option<Errors>) -> (Vec<u32>, StoppedBy) {
    let (mut ends, mut seconds) = (vec![0], 0.0);
    loop {
        let before = ends[ends.len() - 1];
        match waves.next(seconds) {
            Next::Stop(by) => return (ends, by),
            Next::Spread => unreachable!("only where that was decided"),
            Next::To(to) => {
                seconds += pace * f64::from(to - before);
                waves.took(to, pace * f64::from(to - before));
                ends.push(to);
                if waves.looks() {
                    waves.saw(look(to));
                }
            }
        }
    }
}

fn waves(most: u32, target_error: Option<f64>, seconds: Option<f64>) -> Waves {
    let time_limit = seconds.map(Duration::from_secs_f64);
    Waves::new(&Stopping { target_error, time_limit, batch_until: None }, most, Instant::now())
}

fn nothing(_: u32) -> Option<Errors> {
    None
}

#[test]
fn without_target_and_limit_there_is_one_wave() {
    assert_eq!(run(waves(100, None, None), 1.0, nothing), (vec![0, 100], StoppedBy::Spp));
    assert_eq!(waves(100, None, None).expected(0.0), Some(100));
}

#[test]
fn a_target_is_looked_for_at_powers_of_two_and_halfway_between_them() {
    // Independent noise: the error is sqrt(1/4) 1 / (1.5 sqrt(n)), about 0.0333 at 100 samples.
    let look = |spp| Some(errors(spp, 1.0, 32));
    let at_100 = 0.5 / 1.5 / 10.0;
    let (ends, by) = run(waves(1024, Some(1.16 * at_100), None), 1.0, look);
    assert_eq!((ends, by), (vec![0, 32, 64, 96], StoppedBy::TargetError));
    // What cannot be reached ends at the most, also where that is between.
    assert_eq!(run(waves(70, Some(1e-9), None), 1.0, look), (vec![0, 32, 64, 70], StoppedBy::Spp));
    // Never before 64, however small the error.
    assert_eq!(run(waves(1024, Some(1.0), None), 1.0, look), (vec![0, 32, 64], StoppedBy::TargetError));
    assert_eq!(run(waves(16, Some(1.0), None), 1.0, look), (vec![0, 16], StoppedBy::Spp));
    let few = run(waves(1024, Some(1.0), Some(46.0)), 1.0, look);
    assert_eq!(few, (vec![0, 1, 2, 4, 8, 16, 32, 45], StoppedBy::TimeLimit));
}

#[test]
fn both_looks_must_agree_that_the_target_is_reached() {
    let (calm, noisy) = (errors(64, 0.01, 32), errors(64, 1.0, 32));
    let target = noisy.upper_at(256);
    // As if a bright sample came late, or came early and was forgotten.
    for noisy_at in [64, 96] {
        let look = |spp| Some(if spp == noisy_at { noisy.clone() } else { calm.clone() });
        let (ends, _) = run(waves(1024, Some(target), None), 1.0, look);
        let expected = if noisy_at == 64 { &[0, 32, 64, 96, 128][..] } else { &[0, 32, 64] };
        assert_eq!(ends, expected, "{noisy_at}");
    }
}

#[test]
fn what_is_black_twice_has_no_error_to_wait_for() {
    assert_eq!(run(waves(1 << 20, Some(0.01), None), 1.0, nothing), (vec![0, 32, 64], StoppedBy::TargetError));
}

#[test]
fn the_last_wave_fits_into_the_time_that_is_left() {
    for (limit, pace) in [(10.0, 0.1), (10.0, 0.013), (1.0, 0.07), (100.0, 2.0)] {
        let (ends, by) = run(waves(1 << 20, None, Some(limit)), pace, nothing);
        let used = pace * f64::from(ends[ends.len() - 1]);
        assert_eq!(by, StoppedBy::TimeLimit);
        assert!(used <= limit && used > 0.95 * limit - pace, "{limit} {pace}: {used}, {ends:?}");
        assert!(ends[1..ends.len() - 1].iter().all(|end| blocks::is_end(*end)), "{ends:?}");
    }
    // The least picture, in whatever time; and all of it, if there is time.
    assert_eq!(run(waves(64, None, Some(0.5)), 1.0, nothing), (vec![0, 1], StoppedBy::TimeLimit));
    assert_eq!(run(waves(20, None, Some(100.0)), 1.0, nothing), (vec![0, 1, 2, 4, 8, 16, 20], StoppedBy::Spp));
}

#[test]
fn of_two_limits_the_nearer_one_counts_and_is_named() {
    let now = Instant::now();
    let seconds = Duration::from_secs;
    for (own, share, by) in [(5, 50, StoppedBy::TimeLimit), (50, 5, StoppedBy::BatchTimeLimit)] {
        let stopping =
            Stopping { time_limit: Some(seconds(own)), batch_until: Some(now + seconds(share)), ..Stopping::default() };
        assert_eq!(run(Waves::new(&stopping, 1 << 20, now), 1.0, nothing), (vec![0, 1, 2, 4], by));
    }
    let over = Stopping { batch_until: Some(now), ..Stopping::default() };
    let over = Waves::new(&over, 1 << 20, now + seconds(1));
    assert_eq!(run(over, 1.0, nothing), (vec![0, 1], StoppedBy::BatchTimeLimit));
}

#[test]
fn how_many_samples_there_will_be_is_foretold() {
    let mut by_error = waves(1 << 20, Some(errors(64, 1.0, 32).upper_at(256)), None);
    assert_eq!(by_error.expected(0.0), None);
    by_error.took(64, 1.0);
    by_error.saw(Some(errors(64, 1.0, 32)));
    let expected = by_error.expected(1.0).unwrap();
    assert!([256, 384].contains(&expected), "{expected}");
    let mut by_time = waves(1 << 20, None, Some(10.0));
    by_time.took(4, 0.4);
    assert_eq!(by_time.expected(0.4), Some(4 + 94));
}

#[test]
fn samples_are_spread_where_a_target_is_neither_near_nor_out_of_sight_and_work_is_saved() {
    let stated = errors(64, 1.0, 32);
    let at = |target: f64, seconds: Option<f64>, done: u32| {
        let mut waves = waves(1 << 14, Some(target), seconds);
        waves.took(done, 1.0);
        waves.saw(Some(errors(done, 1.0, 32)));
        waves
    };
    let upper = |spp: u32| stated.upper_at(spp);
    assert!(at(upper(256), None, 64).may_spread());
    assert!(!at(upper(80), None, 64).may_spread(), "near");
    assert!(!at(upper(1 << 12), None, 64).may_spread(), "out of sight");
    assert!(at(upper(1 << 12), None, 512).may_spread());
    assert!(!at(upper(256), None, 32).may_spread(), "too early");
    assert!(!at(upper(256), None, 96).may_spread(), "not a power of two");
    assert!(!at(upper(256), Some(1e9), 64).may_spread(), "what time ends must be had by --spp");
    let mut waves = at(upper(256), None, 64);
    assert!(!waves.spreads(0.8) && waves.next(0.0) == Next::To(96));
    assert!(waves.spreads(0.6) && waves.next(0.0) == Next::Spread && !waves.may_spread());
}
