//! Every level computes what plain f32 and u32 arithmetic computes.

use simd::{Float, Kernel, Lanes, Level, Mask, Uint, dispatch};

fn levels() -> Vec<Level> {
    [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512].into_iter().filter(|l| l.is_available()).collect()
}

/// A small generator (Marsaglia xorshift), so that every run sees the same numbers.
struct Rng(u32);

impl Rng {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
}

const COUNT: usize = 256;

/// Runs a closure-like binary operation over all of two arrays.
struct Map<'a, Op> {
    a: &'a [u32],
    b: &'a [u32],
    out: &'a mut [u32],
    op: Op,
}

trait Binary {
    fn apply<L: Lanes>(&self, a: L::U, b: L::U) -> L::U;
}

impl<Op: Binary> Kernel for Map<'_, Op> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for at in (0..COUNT).step_by(L::N) {
            self.op.apply::<L>(L::U::load(self.a, at), L::U::load(self.b, at)).store(self.out, at);
        }
    }
}

fn check(name: &str, op: impl Binary + Copy, reference: impl Fn(u32, u32) -> u32) {
    let mut rng = Rng(12345);
    // Floats of every kind turn up among random bits; moderate ones are mixed in so that sums are not all NaN.
    let mut random =
        |i: usize| if i.is_multiple_of(2) { rng.next() } else { (rng.next() as f32 / 1e8 - 20.0).to_bits() };
    let a: Vec<u32> = (0..COUNT).map(&mut random).collect();
    let b: Vec<u32> = (0..COUNT).map(&mut random).collect();
    for level in levels() {
        let mut out = vec![0; COUNT];
        dispatch(level, Map { a: &a, b: &b, out: &mut out, op });
        for i in 0..COUNT {
            let expected = reference(a[i], b[i]);
            let both_nan = f32::from_bits(expected).is_nan() && f32::from_bits(out[i]).is_nan();
            assert!(out[i] == expected || both_nan, "{name} {level:?}: {:x} {:x} -> {:x}", a[i], b[i], out[i]);
        }
    }
}

macro_rules! float_op {
    ($test:ident, $lanes:expr, $plain:expr) => {
        #[test]
        fn $test() {
            #[derive(Clone, Copy)]
            struct Op;
            impl Binary for Op {
                #[inline(always)]
                fn apply<L: Lanes>(&self, a: L::U, b: L::U) -> L::U {
                    fn call<A: Float>(a: A, b: A, f: impl Fn(A, A) -> A) -> A {
                        f(a, b)
                    }
                    call(a.to_float_bits(), b.to_float_bits(), $lanes).to_bits()
                }
            }
            check(stringify!($test), Op, |a, b| {
                let plain: fn(f32, f32) -> f32 = $plain;
                plain(f32::from_bits(a), f32::from_bits(b)).to_bits()
            });
        }
    };
}
float_op!(add, |a, b| a + b, |a, b| a + b);
float_op!(sub, |a, b| a - b, |a, b| a - b);
float_op!(mul, |a, b| a * b, |a, b| a * b);
float_op!(div, |a, b| a / b, |a, b| a / b);
float_op!(neg, |a, _| -a, |a, _| -a);
float_op!(abs, |a, _| a.abs(), |a, _| a.abs());
float_op!(sqrt, |a, _| a.sqrt(), |a, _| a.sqrt());
float_op!(floor, |a, _| a.floor(), |a, _| a.floor());
float_op!(copysign, |a, b| a.copysign(b), |a, b| a.copysign(b));
float_op!(min_returns_the_second_for_nan, |a, b| a.min(b), |a, b| if a < b { a } else { b });
float_op!(max_returns_the_second_for_nan, |a, b| a.max(b), |a, b| if a > b { a } else { b });
float_op!(select_lt, |a, b| a.or_else(a.lt(b), b), |a, b| if a < b { a } else { b });
float_op!(select_le, |a, b| a.or_else(a.le(b), b), |a, b| if a <= b { a } else { b });
float_op!(select_ge, |a, b| a.or_else(a.ge(b), b), |a, b| if a >= b { a } else { b });
float_op!(select_eq, |a, b| b.or_else(a.eq(a), a), |a, b| if a == a { b } else { a });
float_op!(finite, |a, b| b.or_else(a.is_finite(), a), |a, b| if a.is_finite() { b } else { a });

macro_rules! uint_op {
    ($test:ident, $lanes:expr, $plain:expr) => {
        #[test]
        fn $test() {
            #[derive(Clone, Copy)]
            struct Op;
            impl Binary for Op {
                #[inline(always)]
                fn apply<L: Lanes>(&self, a: L::U, b: L::U) -> L::U {
                    fn call<A: Uint>(a: A, b: A, f: impl Fn(A, A) -> A) -> A {
                        f(a, b)
                    }
                    call(a, b, $lanes)
                }
            }
            let plain: fn(u32, u32) -> u32 = $plain;
            check(stringify!($test), Op, plain);
        }
    };
}
uint_op!(uint_add, |a, b| a + b, u32::wrapping_add);
uint_op!(uint_sub, |a, b| a - b, u32::wrapping_sub);
uint_op!(uint_mul, |a, b| a * b, u32::wrapping_mul);
uint_op!(uint_logic, |a, b| (a & b) ^ (a | b), |a, b| (a & b) ^ (a | b));
uint_op!(uint_shifts, |a, b| a.shl(7) ^ b.shr(9), |a, b| (a << 7) ^ (b >> 9));
uint_op!(uint_shifts_of_each_lane, |a, b| a.shl_each(b.shl(27).shr(27)) ^ a.shr_each(b.shr(27)), |a, b| (a
    << (b & 31))
    ^ (a >> (b >> 27)));
uint_op!(uint_min, |a, b| a.min(b), |a, b| a.min(b));
uint_op!(uint_lt_is_unsigned, |a, b| a.or_else(a.lt(b), b), |a, b| if a < b { a } else { b });
uint_op!(uint_reverse_bits, |a, _| a.reverse_bits(), |a, _| a.reverse_bits());
uint_op!(uint_has, |a, b| b.or_else(a.has(6), a), |a, b| if a & 6 != 0 { b } else { a });
uint_op!(uint_to_float_and_back, |a, _| a.shr(8).to_float().to_uint(), |a, _| a >> 8);

struct Tables<'a> {
    index: &'a [u32],
    table: &'a [f32],
    records: &'a [[f32; 4]],
}

impl Kernel for Tables<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for at in (0..self.index.len()).step_by(L::N) {
            let i = L::U::load(self.index, at);
            let (mut g, mut r) = ([0.0; 16], [[0.0; 16]; 4]);
            i.gather(self.table).store(&mut g, 0);
            let columns = i.records(self.records);
            for (column, out) in columns.iter().zip(&mut r) {
                column.store(out, 0);
            }
            for lane in 0..L::N {
                let k = self.index[at + lane] as usize;
                assert_eq!(g[lane], self.table[k.min(self.table.len() - 1)]);
                assert_eq!(r.map(|column| column[lane]), self.records[k.min(self.records.len() - 1)]);
            }
        }
    }
}

#[test]
fn gathers_and_records_read_the_indexed_element_and_clamp_past_the_end() {
    let mut rng = Rng(7);
    let table: Vec<f32> = (0..100).map(|i| i as f32 * 0.5).collect();
    let records: Vec<[f32; 4]> = (0..90).map(|i| [0, 1, 2, 3].map(|c| (i * 4 + c) as f32)).collect();
    let index: Vec<u32> = (0..COUNT).map(|i| if i % 17 == 0 { rng.next() } else { rng.next() % 100 }).collect();
    for level in levels() {
        dispatch(level, Tables { index: &index, table: &table, records: &records });
    }
}

struct Compress<'a> {
    src: &'a [f32],
    bits: u32,
}

impl Kernel for Compress<'_> {
    type Output = (usize, Vec<f32>);

    #[inline(always)]
    fn run<L: Lanes>(self) -> (usize, Vec<f32>) {
        let keep = L::M::from_bits(self.bits);
        let mut out = vec![0.0; 16];
        L::F::load(self.src, 0).compress(keep, &mut out, 0);
        (keep.count(), out)
    }
}

#[test]
fn compress_packs_the_kept_lanes_in_order_and_masks_round_trip() {
    let src: Vec<f32> = (0..16).map(|i| i as f32 + 1.0).collect();
    let mut rng = Rng(99);
    for level in levels() {
        for _ in 0..300 {
            let n = level.lanes() as usize;
            let bits = rng.next() & ((1u32 << n) - 1);
            let (count, out) = dispatch(level, Compress { src: &src, bits });
            let expected: Vec<f32> = (0..n).filter(|i| bits >> i & 1 == 1).map(|i| src[i]).collect();
            assert_eq!(count, expected.len());
            assert_eq!(out[..count], expected[..], "{level:?} {bits:b}");
        }
    }
}
