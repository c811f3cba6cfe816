//! Areas drawn at a desk.

use crate::world::{drive, events, laser};
use crate::{run, where_is};
use toponym_core::effects::Effect;
use toponym_core::event::{Area, Command, Event};
use toponym_core::geometry::is_near;
use toponym_core::{Config, Mapper};

fn mapped() -> Mapper {
    let mut mapper = Mapper::new(Config::default());
    run(&mut mapper, &events(&drive(1)[..120], &laser(), &[]));
    mapper.step(Event::Flush);
    mapper
}

fn draw(mapper: &mut Mapper, area: &Area) -> Result<String, String> {
    match mapper.step(Event::Command(Command::Area(area.clone()))).into_iter().next() {
        Some(Effect::Mended(done)) => done,
        other => panic!("{other:?}"),
    }
}

fn undo(mapper: &mut Mapper, id: &str) {
    mapper.step(Event::Command(Command::Undo { utterance: Some(id.into()) }));
}

/// A square about the robot.
fn about(mapper: &Mapper, id: &str, name: Option<&str>, half_m: f64) -> Area {
    let at = mapper.snapshot().robot().expect("it is in the map");
    let corner = |dx: f64, dy: f64| (at.x_m + dx * half_m, at.y_m + dy * half_m);
    let polygon_m = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Area { id: id.into(), polygon_m, name: name.map(Into::into), instead: false, forbidden: false }
}

fn p_is(mapper: &Mapper, name: &str) -> f64 {
    where_is(mapper, name).candidates.first().map_or(0.0, |c| c.p_is)
}

#[test]
fn an_area_is_called_as_drawn_until_that_is_taken_back() {
    let mut mapper = mapped();
    let before = (mapper.snapshot().labels(), mapper.snapshot().graph().places);
    let den = about(&mapper, "a", Some("den"), 2.0);
    assert!(draw(&mut mapper, &den).unwrap().ends_with("the den"));
    assert!(p_is(&mapper, "den") > 0.8);
    let snapshot = mapper.snapshot();
    let [area] = &snapshot.areas()[..] else { panic!() };
    let off = area.polygon_m.iter().zip(&den.polygon_m).map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1));
    assert!(off.fold(0.0, f64::max) < 1e-9 && area.name.as_deref() == Some("den"));
    assert!(draw(&mut mapper, &den).is_err(), "once");
    // What was the den is the lab now.
    let lab = Area { instead: true, ..about(&mapper, "b", Some("lab"), 3.0) };
    draw(&mut mapper, &lab).unwrap();
    assert!(p_is(&mapper, "lab") > 0.8 && p_is(&mapper, "den") < 0.5, "{}", p_is(&mapper, "den"));
    undo(&mut mapper, "b");
    // However many said so.
    let again = about(&mapper, "a2", Some("den"), 3.0);
    draw(&mut mapper, &again).unwrap();
    draw(&mut mapper, &Area { id: "b2".into(), ..lab.clone() }).unwrap();
    assert!(p_is(&mapper, "lab") > 0.8 && p_is(&mapper, "den") < 0.5, "{}", p_is(&mapper, "den"));
    for id in ["b2", "a2"] {
        undo(&mut mapper, id);
    }
    assert!(p_is(&mapper, "den") > 0.8, "as it was");
    undo(&mut mapper, "a");
    let after = (mapper.snapshot().labels(), mapper.snapshot().graph().places);
    assert_eq!((after.0.len(), after.1), (before.0.len(), before.1));
    assert_eq!(mapper.snapshot().areas(), []);
}

#[test]
fn nothing_can_be_called_where_the_robot_never_was() {
    let mut mapper = mapped();
    let mut far = about(&mapper, "a", Some("den"), 2.0);
    far.polygon_m.iter_mut().for_each(|corner| corner.0 += 500.0);
    assert!(draw(&mut mapper, &far).unwrap_err().contains("never in that area"));
    let none = Mapper::new(Config::default()).step(Event::Command(Command::Area(far)));
    assert!(matches!(&none[..], [Effect::Mended(Err(_)), ..]), "{none:?}");
}

#[test]
fn no_way_leads_into_what_is_forbidden() {
    let mut mapper = mapped();
    let den = about(&mapper, "a", Some("den"), 2.0);
    draw(&mut mapper, &den).unwrap();
    let goal = |mapper: &Mapper| where_is(mapper, "den").candidates[0].goal;
    let before = goal(&mapper);
    assert_eq!(before.is_reachable, Some(true));
    let out = Area { id: "b".into(), forbidden: true, name: None, ..den.clone() };
    assert!(draw(&mut mapper, &out).unwrap().ends_with("robots keep out of it"));
    let after = goal(&mapper);
    let at = (after.pose.x_m, after.pose.y_m);
    assert!(!is_near(&den.polygon_m, at, 0.3) || after.is_reachable == Some(false), "{after:?}");
    // … nor anywhere, where all of it is.
    let all = Area { id: "c".into(), forbidden: true, ..about(&mapper, "c", None, 100.0) };
    draw(&mut mapper, &all).unwrap();
    assert_eq!(goal(&mapper).is_reachable, Some(false));
    mapper.step(Event::Command(Command::Undo { utterance: None }));
    assert_eq!(mapper.snapshot().areas().len(), 3, "what was drawn is taken back by its id alone");
    undo(&mut mapper, "c");
    undo(&mut mapper, "b");
    assert_eq!(goal(&mapper), before);
}
