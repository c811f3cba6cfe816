//! Where pages are found: told at the start, for a phone's camera too.

use super::api::refuse;
use crate::config::ServerConfig;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use std::io::{self, IsTerminal};
use std::net::{IpAddr, Ipv6Addr, SocketAddr, UdpSocket};
use std::path::PathBuf;
use toponym_proto::answer::{ErrorCode, Problem};
use tracing::info;

/// Nobody is there (RFC 5737): what this machine would send from is its address among others.
const SOMEBODY: (&str, u16) = ("192.0.2.1", 9);

/// On this machine alone.
pub fn tell_local(local: SocketAddr) {
    info!("pages: http://{local}/ shows the map, http://{local}/guide is for whoever talks");
    info!("pages on phones: users, a certificate and --http 0.0.0.0:{} (deploy/README.md)", local.port());
}

/// For others: at a terminal as a code that phones read.
pub fn tell(config: &ServerConfig, local: SocketAddr, authority: bool) {
    let pages = format!("https://{}", host(config, local));
    info!("pages: {pages}/ shows the map, {pages}/guide is for whoever talks");
    if authority {
        info!(
            "a phone trusts them with this server's authority: get {pages}/ca.pem there first, and install it"
        );
    }
    if io::stderr().is_terminal()
        && let Some(code) = code(&format!("{pages}/guide"))
    {
        eprintln!("{code}");
    }
}

/// Under which name others reach an address.
fn host(config: &ServerConfig, local: SocketAddr) -> String {
    if let Some(name) = config.http_hosts.first() {
        return name.clone();
    }
    let mut reached = local;
    if local.ip().is_unspecified() {
        reached.set_ip(own_ip().unwrap_or(IpAddr::V6(Ipv6Addr::LOCALHOST)));
    }
    reached.to_string()
}

/// This machine's address in its network. Nothing is sent.
fn own_ip() -> io::Result<IpAddr> {
    let socket = UdpSocket::bind("0.0.0.0:0")?;
    socket.connect(SOMEBODY)?;
    Ok(socket.local_addr()?.ip())
}

/// A QR code of half blocks.
fn code(text: &str) -> Option<String> {
    let code = QrCode::new(text).ok()?;
    // Dark on light, whatever the terminal's colours: cameras want a light edge.
    Some(code.render::<Dense1x2>().dark_color(Dense1x2::Light).light_color(Dense1x2::Dark).build())
}

/// The local authority's certificate, if `cert new` made one beside the server's.
pub fn authority(config: &ServerConfig) -> Option<PathBuf> {
    let file = config.access.tls.as_ref()?.certificate.with_file_name("ca.pem");
    file.is_file().then_some(file)
}

/// The authority's certificate, for whoever is to trust it.
pub async fn ca(file: PathBuf) -> Response {
    match tokio::fs::read(file).await {
        Ok(pem) => {
            let headers = [
                (header::CONTENT_TYPE, "application/x-x509-ca-cert"),
                (header::CONTENT_DISPOSITION, "attachment; filename=\"toponym-ca.pem\""),
            ];
            (headers, pem).into_response()
        }
        Err(e) => {
            let problem = Problem::new(ErrorCode::Internal, format!("the authority's certificate: {e}"));
            refuse(StatusCode::NOT_FOUND, problem)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_has_the_edge_that_cameras_want() {
        let code = code("https://192.168.1.7:7458/guide").unwrap();
        let lines: Vec<Vec<char>> = code.lines().map(|line| line.chars().collect()).collect();
        assert!(lines.iter().all(|line| line.len() == lines[0].len() && line.len() >= 2 * lines.len() - 1));
        // Four modules of quiet on each side (ISO/IEC 18004), light.
        assert!(lines[..2].iter().flatten().all(|block| *block == '█'), "{code}");
        assert!(lines.iter().all(|line| line[..4].iter().all(|block| "█▀".contains(*block))), "{code}");
    }

    #[test]
    fn others_find_it_by_its_name_or_by_the_machines_address() {
        let config =
            ServerConfig { http_hosts: vec!["maps.example.org:7458".into()], ..ServerConfig::default() };
        assert_eq!(host(&config, "0.0.0.0:7458".parse().unwrap()), "maps.example.org:7458");
        let config = ServerConfig::default();
        assert_eq!(host(&config, "192.168.1.7:7458".parse().unwrap()), "192.168.1.7:7458");
        assert!(!host(&config, "0.0.0.0:7458".parse().unwrap()).starts_with("0.0.0.0"));
    }
}
