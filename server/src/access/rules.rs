//! A policy as rules of Zenoh's access control.

use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use toponym_proto::Keys;

use super::policy::{Policy, Role, User};

/// From clients to the server, or back.
type Flow = &'static str;
const IN: Flow = "ingress";
const OUT: Flow = "egress";

/// What passes: which kinds of messages, which way, on which key expressions.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Grants(BTreeMap<(Flow, &'static str), BTreeSet<String>>);

impl Grants {
    fn add(&mut self, flow: Flow, messages: &[&'static str], key: &str) {
        for message in messages {
            self.0.entry((flow, message)).or_default().insert(key.into());
        }
    }

    /// Publish on a key on which the server listens as `listens`.
    fn publish(&mut self, key: &str, listens: &str) {
        self.add(IN, &["put"], key);
        self.add(OUT, &["declare_subscriber"], listens);
    }

    /// The same with all that an advanced publisher needs: a token and heartbeats that tell of it, and a cache that is asked
    /// for what was missed.
    fn stream(&mut self, key: &str, listens: &str) {
        self.publish(key, listens);
        let (own, asked) = (format!("{key}/@adv/**"), format!("{listens}/@adv/**"));
        self.publish(&own, &asked);
        self.add(IN, &["liveliness_token", "declare_queryable", "reply"], &own);
        self.add(IN, &["reply"], key);
        self.add(OUT, &["query", "liveliness_query", "declare_liveliness_subscriber"], &asked);
    }

    /// Hear what the server publishes.
    fn watch(&mut self, key: &str) {
        self.add(IN, &["declare_subscriber"], key);
        self.add(OUT, &["put"], key);
    }

    /// Ask the server, and hear its answer.
    fn ask(&mut self, key: &str, answers: &str) {
        self.add(IN, &["query"], key);
        self.add(OUT, &["reply"], key);
        self.add(OUT, &["declare_queryable"], answers);
    }
}

/// What a user may. A wider key includes the narrower ones, but whoever is granted these alone can't ask for the wider.
fn grants(keys: &Keys, name: &str, user: &User) -> Grants {
    let (mut grants, any_site, everything) = (Grants::default(), Keys::of_any_site(), keys.everything());
    // Whoever is known may know that the server is there, how it does, and what time it is.
    grants.ask(&any_site.info(), &everything);
    grants.ask(&any_site.time(), &everything);
    grants.add(IN, &["liveliness_query", "declare_liveliness_subscriber"], &any_site.alive("*"));
    grants.add(OUT, &["liveliness_token"], &keys.alive("*"));
    let is = |roles: &[Role]| user.role == Role::Trusted || roles.contains(&user.role);
    for robot in robots(name, user) {
        if is(&[Role::Robot]) {
            grants.stream(&keys.inputs(robot), &keys.all_inputs());
        }
        if is(&[Role::Guide]) {
            grants.publish(&keys.say(Some(robot)), &keys.say(Some("*")));
        }
        if is(&[Role::Robot, Role::Guide, Role::Operator]) {
            grants.watch(&keys.outputs(robot));
            grants.ask(&keys.outputs(robot), &everything);
        }
    }
    if is(&[Role::Planner, Role::Viewer]) {
        // Not what people said, and became of it.
        for key in [keys.pose("*"), keys.state("*")] {
            grants.watch(&key);
            grants.ask(&key, &everything);
        }
    }
    if is(&[Role::Guide, Role::Planner, Role::Viewer, Role::Operator]) {
        grants.ask(&any_site.asks("*"), &everything);
        grants.watch(&keys.map_outputs("*"));
        grants.ask(&keys.map_outputs("*"), &everything);
    }
    if is(&[Role::Planner]) {
        grants.ask(&keys.command("go"), &everything);
    }
    if is(&[Role::Guide]) {
        for command in ["undo", "rename", "forget", "initial_pose"] {
            grants.ask(&keys.command(command), &everything);
        }
    }
    if is(&[Role::Operator]) {
        grants.ask(&keys.command("*"), &everything);
    }
    if is(&[]) {
        // What is asked on a wrong key is told so, too.
        grants.ask(&everything, &everything);
    }
    grants
}

/// As or to which robots a user may talk; `*`: all.
fn robots<'a>(name: &'a str, user: &'a User) -> Vec<&'a str> {
    match user.role {
        Role::Robot if user.robots.is_empty() => vec![name],
        Role::Robot | Role::Guide if !user.robots.is_empty() => {
            user.robots.iter().map(String::as_str).collect()
        }
        _ => vec!["*"],
    }
}

/// The policy as Zenoh's `access_control`: what nobody was granted is dropped, both ways.
pub fn rules(keys: &Keys, policy: &Policy) -> Value {
    let mut subjects = BTreeMap::<Grants, Vec<(String, Value)>>::new();
    let known_by = if policy.by_password() { "usernames" } else { "cert_common_names" };
    for (name, user) in &policy.users {
        let subject = json!({"id": name, (known_by): [name]});
        subjects.entry(grants(keys, name, user)).or_default().push((name.clone(), subject));
    }
    if policy.local {
        let all = User { role: Role::Trusted, robots: Vec::new(), password: None };
        // No user's name has a space in it.
        let subject = ("this machine".to_owned(), json!({"id": "this machine", "interfaces": ["lo", "lo0"]}));
        subjects.entry(grants(keys, "", &all)).or_default().push(subject);
    }
    let (mut rules, mut policies, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for (number, (grants, subjects)) in subjects.into_iter().enumerate() {
        let mut ids = Vec::new();
        for ((flow, message), keys) in grants.0 {
            let id = format!("{number} {flow} {message}");
            rules.push(json!({
                "id": id, "flows": [flow], "messages": [message], "permission": "allow", "key_exprs": keys
            }));
            ids.push(id);
        }
        let (names, described): (Vec<String>, Vec<Value>) = subjects.into_iter().unzip();
        policies.push(json!({"rules": ids, "subjects": names}));
        all.extend(described);
    }
    json!({
        "enabled": true, "default_permission": "deny", "rules": rules, "subjects": all, "policies": policies
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    fn user(role: Role, robots: &[&str]) -> User {
        let robots = robots.iter().map(ToString::to_string).collect();
        User { role, robots, password: Some("secret".into()) }
    }

    /// All that a user is granted, a line each.
    fn told(name: &str, user: &User) -> String {
        let granted = grants(&Keys::new("lab").unwrap(), name, user);
        let line = |((flow, message), keys): (&(Flow, &str), &BTreeSet<String>)| {
            let keys = keys.iter().map(|k| k.replace("toponym/v1/", "")).collect::<Vec<_>>();
            format!("{flow} {message}: {}\n", keys.join(" "))
        };
        granted.0.iter().map(line).collect()
    }

    #[test]
    fn what_each_role_is_granted() {
        let mut all = String::new();
        for (role, robots) in [
            (Role::Robot, &[][..]),
            (Role::Guide, &["r07"]),
            (Role::Planner, &[]),
            (Role::Viewer, &[]),
            (Role::Operator, &[]),
            (Role::Trusted, &[]),
        ] {
            let _ = writeln!(all, "# {role:?} of {robots:?}\n{}", told("r08", &user(role, robots)));
        }
        assert_eq!(all, include_str!("granted.txt"), "granted.txt is not what is granted now:\n{all}");
    }

    #[test]
    fn nobody_is_granted_what_is_the_servers() {
        for role in Role::ALL {
            let all = grants(&Keys::new("lab").unwrap(), "r07", &user(role, &[])).0;
            let none = BTreeSet::new();
            let of = |flow, message| all.get(&(flow, message)).unwrap_or(&none);
            let own = |key: &String| key.contains("/in/") || key.ends_with("/say");
            assert!(of(IN, "put").iter().chain(of(IN, "reply")).all(own), "{role:?}");
            assert!(
                of(IN, "declare_queryable").iter().all(|key| key.ends_with("/in/**/@adv/**")),
                "{role:?}"
            );
            assert!(of(IN, "declare_subscriber").iter().all(|key| key.contains("/out/")), "{role:?}");
        }
    }

    #[test]
    fn users_who_may_the_same_share_rules() {
        let mut policy = Policy::default();
        for name in ["anna", "bert", "carl"] {
            policy
                .users
                .insert(name.into(), user(if name == "carl" { Role::Viewer } else { Role::Guide }, &[]));
        }
        let rules = rules(&Keys::new("lab").unwrap(), &policy);
        assert_eq!(rules["policies"].as_array().unwrap().len(), 2);
        assert_eq!(rules["subjects"].as_array().unwrap().len(), 3);
        assert_eq!(rules["subjects"][0]["usernames"][0], "anna");
    }
}
