//! Inputs for targets: good ones, changed at random. The n-th input of a seed is the same each time, whatever came before.
//!
//! `TOPONYM_FUZZ` sets how many inputs a target is fed, `TOPONYM_SEED` begins another series.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::env;

/// Inputs of a target unless told otherwise.
const INPUTS: u64 = 3000;
/// No input is longer: what is long is slow, and finds no more.
const LONGEST: usize = 1 << 14;
/// Changes of one input.
const CHANGES: std::ops::RangeInclusive<usize> = 1..=5;
/// Times that a slice is said over again.
const REPEATS: std::ops::RangeInclusive<usize> = 1..=40;
/// Numbers round which parsers go wrong; of each its lowest bytes are written.
const NUMBERS: [u64; 24] = [
    0,
    1,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    1 << 46,
    (1 << 46) + 1,
    (1 << 53) - 1,
    1 << 62,
    i64::MAX as u64,
    1 << 63,
    u64::MAX,
    // NaN and infinity as floats; both and 1e300 as doubles.
    0x7fc0_0000,
    0x7f80_0000,
    0x7ff8_0000_0000_0000,
    0x7ff0_0000_0000_0000,
    0x7e37_e43c_8800_759c,
];

/// A source of inputs.
pub struct Mutator {
    /// Good ones; at least one.
    pub seeds: Vec<Vec<u8>>,
    /// What the format is made of.
    pub tokens: Vec<Vec<u8>>,
}

impl Mutator {
    /// From texts.
    pub fn of_texts(seeds: &[&str], tokens: &str) -> Self {
        let seeds = seeds.iter().map(|seed| seed.as_bytes().to_vec()).collect();
        Self { seeds, tokens: tokens.split_whitespace().map(|token| token.as_bytes().to_vec()).collect() }
    }

    /// A good input, changed.
    pub fn input(&self, random: &mut ChaCha8Rng) -> Vec<u8> {
        let mut bytes = pick(&self.seeds, random).clone();
        self.change(&mut bytes, random);
        bytes
    }

    /// A good input as a medium damages it: bits turn, bytes are others, the end is cut.
    pub fn damaged(&self, random: &mut ChaCha8Rng) -> Vec<u8> {
        let mut bytes = pick(&self.seeds, random).clone();
        for _ in 0..random.random_range(1..=3) {
            let (from, to) = slice(&bytes, random);
            match random.random_range(0..5) {
                0 | 1 if from < bytes.len() => bytes[from] ^= 1 << random.random_range(0..8),
                2 => bytes[from..to].fill(0),
                3 => random.fill(&mut bytes[from..to]),
                _ => bytes.truncate(bytes.len() - random.random_range(0..=bytes.len().min(64))),
            }
        }
        bytes
    }

    /// Changes an input in a place, or in a few.
    fn change(&self, bytes: &mut Vec<u8>, random: &mut ChaCha8Rng) {
        // One change alone is what most likely still passes for good.
        let changes = if random.random_bool(0.5) { 1 } else { random.random_range(CHANGES) };
        for _ in 0..changes {
            self.change_once(bytes, random);
        }
        bytes.truncate(LONGEST);
    }

    fn change_once(&self, bytes: &mut Vec<u8>, random: &mut ChaCha8Rng) {
        let (from, to) = slice(bytes, random);
        match random.random_range(0..10) {
            0 | 1 if from < bytes.len() => bytes[from] ^= 1 << random.random_range(0..8),
            2 => {
                let number = pick(&NUMBERS, random).to_le_bytes();
                let length = *pick(&[1, 2, 4, 8], random);
                for (byte, new) in bytes.iter_mut().skip(from).zip(number).take(length) {
                    *byte = new;
                }
            }
            3 => bytes.truncate(from),
            4 => drop(bytes.drain(from..to)),
            5 => {
                let again = bytes[from..to].repeat(random.random_range(REPEATS));
                let room = LONGEST.saturating_sub(bytes.len());
                bytes.splice(to..to, again.into_iter().take(room));
            }
            6 => {
                let other = pick(&self.seeds, random);
                let at = random.random_range(0..=other.len());
                bytes.truncate(from);
                bytes.extend(&other[at..]);
            }
            7 => drop(bytes.splice(from..from, self.token(random))),
            8 => drop(bytes.splice(from..to, self.token(random))),
            _ => {
                let (from, to) = digits(bytes, from);
                bytes.splice(from..to, self.number(random));
            }
        }
    }

    fn token(&self, random: &mut ChaCha8Rng) -> Vec<u8> {
        if self.tokens.is_empty() { Vec::new() } else { pick(&self.tokens, random).clone() }
    }

    /// A token that is a number; any if none is.
    fn number(&self, random: &mut ChaCha8Rng) -> Vec<u8> {
        let is_number = |token: &&Vec<u8>| matches!(token.as_slice(), [b'-' | b'0'..=b'9', ..]);
        let numbers: Vec<&Vec<u8>> = self.tokens.iter().filter(is_number).collect();
        if numbers.is_empty() { self.token(random) } else { (*pick(&numbers, random)).clone() }
    }
}

/// A short slice of it: where it begins and ends.
fn slice(bytes: &[u8], random: &mut ChaCha8Rng) -> (usize, usize) {
    let from = random.random_range(0..=bytes.len());
    let longest = *pick(&[1, 2, 4, 16, 64, 512], random);
    let to = (from + random.random_range(1..=longest)).min(bytes.len());
    (from, to)
}

/// The next number of a text from a place on: where it begins and ends.
fn digits(bytes: &[u8], at: usize) -> (usize, usize) {
    let from = bytes.iter().skip(at).position(u8::is_ascii_digit).map_or(bytes.len(), |ahead| at + ahead);
    let length = bytes[from..].iter().take_while(|byte| matches!(byte, b'0'..=b'9' | b'.')).count();
    (from, from + length)
}

/// Any of some.
pub fn pick<'a, T>(all: &'a [T], random: &mut ChaCha8Rng) -> &'a T {
    &all[random.random_range(0..all.len())]
}

/// Feeds a target with inputs, and tells how many it took. What `feed` panics of is told with the input and its number.
///
/// A target that is slow is fed with one input of `every` so many.
pub fn fuzz(
    target: &str,
    every: u64,
    make: impl Fn(&mut ChaCha8Rng) -> Vec<u8>,
    feed: impl Fn(&[u8], &mut ChaCha8Rng) -> bool,
) {
    let (inputs, seed) = (setting("TOPONYM_FUZZ", INPUTS) / every, setting("TOPONYM_SEED", 1));
    series(target, (inputs, seed), make, feed);
}

fn series(
    target: &str,
    (inputs, seed): (u64, u64),
    make: impl Fn(&mut ChaCha8Rng) -> Vec<u8>,
    feed: impl Fn(&[u8], &mut ChaCha8Rng) -> bool,
) {
    let mut taken = 0;
    for number in 0..inputs {
        let mut random = generator(seed, number);
        let bytes = make(&mut random);
        let _told = Told { target, seed, number, bytes: &bytes };
        taken += u64::from(feed(&bytes, &mut random));
    }
    println!("{target}: {inputs} inputs of seed {seed}, {taken} taken");
}

fn setting(name: &str, default: u64) -> u64 {
    env::var(name).map_or(default, |text| text.parse().unwrap_or_else(|e| panic!("{name}={text}: {e}")))
}

fn generator(seed: u64, number: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&number.to_le_bytes());
    ChaCha8Rng::from_seed(key)
}

/// Tells which input it was, should the target panic.
struct Told<'a> {
    target: &'a str,
    seed: u64,
    number: u64,
    bytes: &'a [u8],
}

impl Drop for Told<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let Self { target, seed, number, bytes } = self;
            eprintln!("{target}, seed {seed}, input {number}: {}", bytes.escape_ascii());
        }
    }
}

/// A target that must fail: were it not found out, nothing would be.
#[test]
#[should_panic(expected = "a robot of 2^32 letters or more")]
fn a_planted_fault_is_found() {
    let seeds = crate::seeds::messages().iter().map(|m| m.to_bincode().unwrap()).collect();
    let mutator = Mutator { seeds, tokens: Vec::new() };
    series(
        "planted",
        (INPUTS, 1),
        |random| mutator.input(random),
        |bytes, _| {
            let length = toponym_proto::frame::u64_at(bytes, 2).unwrap_or_default();
            assert!(length < 1 << 32, "a robot of 2^32 letters or more");
            true
        },
    );
}
