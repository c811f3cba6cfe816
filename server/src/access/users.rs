//! `user`: adds, revokes and lists users.

use anyhow::{Context as _, bail};
use clap::{Args, Subcommand};
use std::fs;
use std::path::PathBuf;
use toponym_proto::keys::check_id;
use ulid::Ulid;

use super::policy::{Policy, Role, User, make_folder};
use crate::config::ServerConfig;

/// Say who may do what.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  toponym-server user add r07 --role robot
  toponym-server user add anna --role guide --robot r07
  TOPONYM_USER=anna TOPONYM_PASSWORD=… toponym say 'this is the gym'
  toponym-server user revoke anna

  robot     streams as its robots, and hears what became of it
  guide     talks to robots, hears what became of it, asks, mends what was said
  planner   asks where things are, follows robots and maps
  viewer    the same, for people who look at it
  operator  the same, and hears, mends, saves and deletes
  trusted   everything: for a Zenoh router that checks its own clients

As soon as there is a user, nobody else may connect. A server that runs takes changes over within two seconds, and who was
revoked is cut off; robots and guides go on where they were.")]
pub struct UserArgs {
    #[command(subcommand)]
    command: UserCommand,
    /// Settings of the server, which say where its users are
    #[arg(long, global = true, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Folder of the maps, instead of the settings'
    #[arg(long, global = true, value_name = "FOLDER")]
    data: Option<PathBuf>,
}

#[derive(Clone, Debug, Subcommand)]
enum UserCommand {
    /// Let somebody in, or change what they may
    Add {
        /// Name: lower case, digits, - and _
        name: String,
        /// What they may
        #[arg(long, value_enum)]
        role: Role,
        /// As which robots (robots) or to which (guides) [default: robots: the one of that name; guides: all]
        #[arg(long, value_name = "ID")]
        robot: Vec<String>,
        /// First line is the password, instead of one that is made up and printed
        #[arg(long, value_name = "FILE")]
        password_file: Option<PathBuf>,
    },
    /// Let somebody in no more
    Revoke {
        /// Name
        name: String,
    },
    /// Who is let in?
    List,
}

/// Carries a command out.
pub fn edit_users(args: &UserArgs) -> anyhow::Result<()> {
    let mut config = match &args.config {
        Some(path) => ServerConfig::read(path)?,
        None => ServerConfig::default(),
    };
    if let Some(data) = &args.data {
        config.data.clone_from(data);
    }
    let path = config.policy_path();
    let mut policy = Policy::read(&path)?;
    policy.local = false;
    match &args.command {
        UserCommand::Add { name, role, robot, password_file } => {
            check_id("user", name)?;
            let by_certificate = config.access.tls.as_ref().is_some_and(|tls| tls.clients_ca.is_some());
            let given = password_file.as_ref().map(|file| {
                let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
                Ok::<_, anyhow::Error>(text.lines().next().unwrap_or_default().to_owned())
            });
            let known = policy.users.get(name).and_then(|user| user.password.clone());
            let password = match given.transpose()? {
                None if by_certificate => None,
                None => Some(known.clone().unwrap_or_else(made_up)),
                given => given,
            };
            let user = User { role: *role, robots: robot.clone(), password: password.clone() };
            policy.users.insert(name.clone(), user);
            if let Some(folder) = path.parent() {
                make_folder(folder).with_context(|| folder.display().to_string())?;
            }
            policy.write(&path)?;
            println!("{name} is a {} now ({})", word(*role), path.display());
            match password {
                None => println!("known by a certificate: toponym-server cert new --client {name}"),
                Some(password) if password_file.is_none() && known.is_none() => println!(
                    "password (told only here): {password}\nconnect with TOPONYM_USER={name} TOPONYM_PASSWORD={password}"
                ),
                Some(_) => {}
            }
        }
        UserCommand::Revoke { name } => {
            if policy.users.remove(name).is_none() {
                let known: Vec<&str> = policy.users.keys().map(String::as_str).collect();
                bail!("there is no user {name:?} in {}; there are: {}", path.display(), known.join(", "));
            }
            policy.write(&path)?;
            println!("{name} is let in no more ({})", path.display());
        }
        UserCommand::List => {
            for (name, user) in &policy.users {
                println!("{name:<20} {:<9} {}", word(user.role), user.robots.join(" "));
            }
        }
    }
    Ok(())
}

fn word(role: Role) -> String {
    format!("{role:?}").to_lowercase()
}

/// 80 random bits, as people can read them to each other.
fn made_up() -> String {
    let random = Ulid::generate().to_string().to_lowercase();
    [&random[10..14], &random[14..18], &random[18..22], &random[22..]].join("-")
}
