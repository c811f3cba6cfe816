//! Where the robot is, pointed out by somebody who sees it: evidence for its graphs, as what is said, and not the truth.

use crate::event::{StampNs, Told};
use crate::filter::Filter;
use crate::geometry::Pose2;
use crate::language::act::Parse;
use crate::talk::claims::{Claim, Claims, Testimony};
use crate::talk::ledger::Entry;
use crate::talk::{Here, Talk};
use std::sync::Arc;

/// Takes it in, and tells how the map has it so far; `body_from_place`: where the place held lies, by the front end.
pub(crate) fn tell(
    talk: &mut Talk,
    filter: &mut Filter,
    (told, stamp_ns): (&Told, StampNs),
    body_from_place: &Pose2,
    here: &Here,
) -> Result<String, String> {
    let held = here.held.ok_or("the robot has not seen anything yet")?;
    if talk.ledger.has(&told.id) {
        return Err(format!("{:?} was told before", told.id));
    }
    if talk.ledger.is_full() {
        return Err("this map has heard all that it can keep".into());
    }
    let Pose2 { x_m, y_m, yaw_rad } = told.map_from_body;
    let at = format!("x {x_m:.2} m, y {y_m:.2} m, heading {:.0}°", yaw_rad.to_degrees());
    let text = format!("the robot is at {at}");
    let entry = Entry { id: told.id.clone(), stamp_ns, text, parse: Parse::default(), held, stands: true };
    let utterance = Arc::make_mut(&mut talk.ledger).enter(entry, false);
    let map_from_place = told.map_from_body.compose(body_from_place);
    let claim = Claim::At { place: held, map_from_place, sigma: [told.sigma_m, told.sigma_rad] };
    let readings = vec![Claims { weight: 1.0, claims: vec![(1.0, claim)] }];
    let before = talk.testimonies.pose(filter.best(), held);
    talk.testimonies.add(Testimony { utterance, readings }, filter.best(), here);
    filter.look_near(held, map_from_place, told.sigma_m);
    filter.weigh_words(talk);
    let off_m = before.map_or(f64::INFINITY, |pose| pose.distance_m(&map_from_place));
    Ok(if off_m < 3.0 * told.sigma_m {
        format!("The map has the robot {off_m:.1} m from {at}, too.")
    } else {
        format!("The map has the robot {off_m:.1} m from {at}: I look for it there.")
    })
}
