//! `cert`: a local authority, and certificates from it.

use anyhow::{Context as _, bail};
use clap::{Args, Subcommand};
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer,
    KeyPair, KeyUsagePurpose,
};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use toponym_proto::keys::check_id;

use super::policy::{make_folder, write_secret};

/// How long the authority is valid.
const CA_DAYS: u64 = 3650;
const DAY: Duration = Duration::from_secs(86_400);

/// Make certificates for TLS: a local authority, and with it the server's and its clients'.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  toponym-server cert new --name maps.example.org --name 192.168.1.7      the server's
  toponym-server cert new --client anna                                   a user's, who then needs no password

Settings of the server:
  listen = [\"quic/0.0.0.0:7457\"]
  [access.tls]
  certificate = \"tls/server.pem\"
  key = \"tls/server-key.pem\"
  clients_ca = \"tls/ca.pem\"        only if clients are to be known by certificates

Clients need ca.pem, to know the server by:
  toponym --connect quic/maps.example.org:7457 --ca ca.pem [--cert anna.pem --key anna-key.pem] …

ca-key.pem stays where it is, and is best kept off the server: whoever has it can make certificates for anybody.")]
pub struct CertArgs {
    #[command(subcommand)]
    command: CertCommand,
}

#[derive(Clone, Debug, Subcommand)]
enum CertCommand {
    /// Make a certificate, and the authority if there is none yet
    New(NewCert),
}

/// Arguments of `cert new`.
#[derive(Args, Clone, Debug)]
struct NewCert {
    /// Names and addresses by which clients connect to the server [default: localhost, 127.0.0.1, ::1]
    #[arg(long, value_name = "HOST", conflicts_with = "client")]
    name: Vec<String>,
    /// For a user of this name, not for the server
    #[arg(long, value_name = "USER")]
    client: Option<String>,
    /// Folder of the certificates
    #[arg(long, value_name = "FOLDER", default_value = "tls")]
    folder: PathBuf,
    /// For how many days
    #[arg(long, value_name = "N", default_value_t = 397, value_parser = clap::value_parser!(u64).range(1..=CA_DAYS))]
    days: u64,
}

/// Carries a command out.
pub fn make_certificate(args: &CertArgs) -> anyhow::Result<()> {
    let CertCommand::New(new) = &args.command;
    make_folder(&new.folder).with_context(|| new.folder.display().to_string())?;
    let issuer = authority(&new.folder)?;
    let (file, names, usage) = match &new.client {
        Some(user) => {
            check_id("user", user)?;
            if ["ca", "server"].contains(&user.as_str()) {
                bail!("{user} is no user's name: its file would be another's");
            }
            (user.as_str(), vec![], ExtendedKeyUsagePurpose::ClientAuth)
        }
        None if new.name.is_empty() => {
            let names = ["localhost", "127.0.0.1", "::1"].map(Into::into).to_vec();
            ("server", names, ExtendedKeyUsagePurpose::ServerAuth)
        }
        None => ("server", new.name.clone(), ExtendedKeyUsagePurpose::ServerAuth),
    };
    let mut leaf = params(new.client.as_deref().unwrap_or("toponym server"), names, new.days)?;
    leaf.extended_key_usages = vec![usage];
    leaf.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    leaf.use_authority_key_identifier_extension = true;
    let key = KeyPair::generate()?;
    let signed = leaf.signed_by(&key, &issuer)?;
    save(&new.folder, file, &signed.pem(), &key)?;
    let path = |name: &str| new.folder.join(name).display().to_string();
    println!(
        "{} and {}, for {} days",
        path(&format!("{file}.pem")),
        path(&format!("{file}-key.pem")),
        new.days
    );
    println!("signed by {}, which clients need to know the server by", path("ca.pem"));
    Ok(())
}

/// The authority of a folder, made at need.
fn authority(folder: &Path) -> anyhow::Result<Issuer<'static, KeyPair>> {
    let mut ca = params("toponym local authority", vec![], CA_DAYS)?;
    ca.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    ca.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    let path = folder.join("ca-key.pem");
    let key = if path.exists() {
        let pem = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        KeyPair::from_pem(&pem).with_context(|| path.display().to_string())?
    } else {
        if folder.join("ca.pem").exists() {
            bail!("{} is not there, but ca.pem is: bring the key here to sign with it", path.display());
        }
        let key = KeyPair::generate()?;
        save(folder, "ca", &ca.self_signed(&key)?.pem(), &key)?;
        key
    };
    // What signs is told by name and key, which are the same for each certificate made of them.
    Ok(Issuer::new(ca, key))
}

fn params(common_name: &str, names: Vec<String>, days: u64) -> anyhow::Result<CertificateParams> {
    let mut params = CertificateParams::new(names).context("--name")?;
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, common_name);
    let now = SystemTime::now();
    // Clocks differ: it is valid as of yesterday.
    params.not_before = (now - DAY).into();
    params.not_after = (now + u32::try_from(days)? * DAY).into();
    Ok(params)
}

fn save(folder: &Path, name: &str, certificate: &str, key: &KeyPair) -> anyhow::Result<()> {
    let path = folder.join(format!("{name}-key.pem"));
    write_secret(&path, key.serialize_pem().as_bytes()).with_context(|| path.display().to_string())?;
    let path = folder.join(format!("{name}.pem"));
    fs::write(&path, certificate).with_context(|| path.display().to_string())
}
