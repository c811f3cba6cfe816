//! A square ring whose four sides are alike, left for its dark middle and entered again: `ring`.

use super::Tour;
use super::design::{Design, Return, Walk, first_that_fits};
use super::stamp::Quarter;
use super::unit::WALL_M;
use super::words::Names;
use crate::SimError;
use crate::building::{furnish_once, pieces};
use crate::geom::{Point, Rect};
use crate::random::Draw;
use crate::world::Plan;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Radius of the circles in the middle, metres: narrow ones cost wheels their bearings soonest.
const CIRCLE_M: f64 = 1.0;
/// Points of a circle.
const POINTS: usize = 12;
/// Circles at first, and at most.
const ROUNDS: (usize, usize) = (7, 16);
/// Distance of the look-alikes in standard deviations of the wheels: three of them on both sides
/// are more than one.
const AIM: (f64, f64) = (1.0, 1.6);
/// σ of the turn error of wheels on such a tour.
const TURN: f64 = 0.05;
/// What a return may have led to, seen from where it left.
const DOORS: [&str; 4] = ["the door it left by", "a quarter on", "half round", "a quarter back"];
/// The guide says nothing for so long after the return.
const LATE_M: f64 = 14.0;

/// One side: its corridor is room 0, then the two rooms outward of it.
struct Side {
    hub_m: f64,
    half_m: f64,
    wide_m: f64,
    deep_m: f64,
    /// Where the door to the middle and those to the rooms are along the side, and the rooms' wall.
    doors: [f64; 3],
    wall: f64,
    furnished: u64,
}

impl Side {
    fn draw(draw: &mut Draw) -> Self {
        // So large that no way from corridor to corridor is seen across it.
        let (hub_m, wide_m) = (draw.within((3.6, 4.2)), draw.within((1.9, 2.3)));
        let half_m = hub_m + WALL_M + wide_m;
        let wall = draw.within((-0.2, 0.2)) * half_m;
        let doors = [
            draw.within((-0.4, 0.4)) * hub_m,
            draw.within((-0.8, -0.5)) * half_m,
            draw.within((0.5, 0.8)) * half_m,
        ];
        let furnished = draw.below(1 << 30) as u64;
        Self { hub_m, half_m, wide_m, deep_m: draw.within((4.0, 5.5)), doors, wall, furnished }
    }

    /// The southern one; its second room is another than all others' if it is `odd`.
    fn plan(&self, odd: bool) -> Plan {
        let (h, hub) = (self.half_m, self.hub_m);
        let outer = -h - WALL_M;
        let mut plan = Plan::default();
        plan.corridor("", Rect::new([-h, -h], [h, -h + self.wide_m]));
        // No way leads through the middle: the ring is driven round.
        let [x, a, b] = self.doors;
        plan.floor.push(Rect::new([x - 0.6, -hub - WALL_M], [x + 0.6, -hub]));
        plan.waypoints.push([x, -hub - WALL_M - self.wide_m / 2.0]);
        let deep_m = if odd { self.deep_m + 1.5 } else { self.deep_m };
        plan.room("", Rect::new([-h, outer - self.deep_m], [self.wall - WALL_M / 2.0, outer]));
        plan.room("", Rect::new([self.wall + WALL_M / 2.0, outer - deep_m], [h, outer]));
        plan.door([a, -h], [a, outer], 1.1);
        plan.door([b, -h], [b, outer], 1.1);
        // Glare in the doorway: nobody sees in from outside.
        plan.dark(Rect::new([b - 0.6, outer + WALL_M / 4.0], [b + 0.6, -h - WALL_M / 4.0]));
        for (room, odd) in [(1, false), (2, odd)] {
            let mut draw = Draw::new(self.furnished + u64::from(odd), room as u64);
            for _ in 0..pieces(1.3, &plan.rooms[room].1).max(4) {
                furnish_once(&mut plan, room, &mut draw);
            }
        }
        plan
    }

    /// Just inside the ring's door, and just within the middle, south.
    fn door(&self) -> [Point; 2] {
        let x = self.doors[0];
        [[x, -self.hub_m - WALL_M - self.wide_m / 2.0], [x, -self.hub_m + 0.8]]
    }
}

/// The tour.
pub(super) fn ring(name: &'static str, seed: u64) -> Result<Tour, SimError> {
    let rounds = (ROUNDS.0..=ROUNDS.1).step_by(3);
    first_that_fits(name, seed, rounds.map(|rounds| design(name, seed, rounds)))
}

fn design(name: &str, seed: u64, rounds: usize) -> Result<Design, SimError> {
    let mut draw = Draw::new(seed, 4);
    let decided = name.ends_with("-decided");
    let side = Side::draw(&mut draw);
    let mut names = Names::new(&mut draw);
    let (home, led, odd) = (draw.below(4), draw.below(4), draw.below(4));
    let mut plan = Plan::default();
    let mut firsts = Vec::new();
    for k in 0..4 {
        let names = ["hallway".to_owned(), names.next().to_owned(), names.next().to_owned()];
        let at = Quarter::turn(k as u8);
        firsts.push(plan.stamp(&side.plan(decided && k == odd), &at, |r| names[r].clone()));
    }
    let mut hub = Plan::default();
    hub.room("", Rect::new([-side.hub_m, -side.hub_m], [side.hub_m, side.hub_m]));
    let dark_m = side.hub_m + WALL_M / 2.0;
    hub.dark(Rect::new([-dark_m, -dark_m], [dark_m, dark_m]));
    plan.stamp(&hub, &Quarter::default(), |_| String::new());
    let world = plan.build();
    let mut walk = Walk::from_room(&world, firsts[home] + 1)?;
    for k in 1..=4 {
        walk.to(firsts[(home + k) % 4] + 1)?;
    }
    if decided {
        walk.to(firsts[odd] + 2)?;
    }
    let doors = |k: usize| side.door().map(|p| Quarter::turn(k as u8).point(p));
    let mut open = vec![doors(home)[1]];
    open.extend(circles(home, led, rounds, draw.chance(0.5)));
    open.push(doors(led)[1]);
    walk.across(doors(home)[0], &open, doors(led)[0], firsts[led] + 1)?;
    for k in 1..=4 {
        walk.to(firsts[(led + k) % 4] + 1)?;
    }
    walk.to(firsts[(led + 1) % 4] + if decided { 1 } else { 2 })?;
    if decided {
        walk.to(firsts[odd] + 2)?;
    }
    let (start, legs) = (walk.start, walk.legs);
    let returns: Return =
        (0..4).map(|k| (DOORS[(led + k + 4 - home) % 4].to_owned(), Quarter::turn(k as u8).pose())).collect();
    let aim = draw.within(AIM);
    let plain = Design::plain(world, start, legs);
    Ok(Design { returns: vec![returns], late_m: LATE_M, turn: Some(TURN), aim, ..plain })
}

/// Round and round the middle from before one side's door to before another's.
fn circles(from: usize, to: usize, rounds: usize, left: bool) -> Vec<Point> {
    let quarters = if left { (to + 4 - from) % 4 } else { (from + 4 - to) % 4 };
    let points = POINTS * rounds + quarters * POINTS / 4;
    let step = TAU / POINTS as f64 * if left { 1.0 } else { -1.0 };
    let start = (from as f64 - 1.0) * FRAC_PI_2;
    (0..=points)
        .map(|k| (start + step * k as f64).sin_cos())
        .map(|(s, c)| [CIRCLE_M * c, CIRCLE_M * s])
        .collect()
}
