//! Requests to addresses that users name: only to the public internet, unless an operator allows more.
//!
//! Names are looked up by a resolver of our own, which hands the connection nothing but addresses that were checked: a name whose
//! address changes between check and connection gains nothing. Redirects are not followed.

use reqwest::dns::{Addrs, Name, Resolve, Resolving};
use reqwest::{Client, Url};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

/// Why an address is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum AddressRefused {
    /// No address of a web server.
    #[error("{0:?} is no address: give https://HOST/PATH, without a user or a fragment")]
    Form(String),
    /// Not for requests of this service.
    #[error("{0} is not a public address; an operator can allow others by --private-webhooks")]
    Private(String),
}

/// Longest address, bytes.
const LONGEST: usize = 2000;

/// Longest time for a connection and for a whole request.
const CONNECT: Duration = Duration::from_secs(5);
const TIME: Duration = Duration::from_secs(10);

/// The address of a web server that may be asked, as far as it can be told without looking its name up.
///
/// # Errors
/// If it is none, or names an address that is not public.
pub(crate) fn checked(text: &str, private: bool) -> Result<Url, AddressRefused> {
    let form = || AddressRefused::Form(text.chars().take(LONGEST).collect());
    let url = Url::parse(text).ok().filter(|_| text.len() <= LONGEST).ok_or_else(form)?;
    let plain = url.username().is_empty() && url.password().is_none() && url.fragment().is_none();
    let host = url.host_str().filter(|_| plain && matches!(url.scheme(), "http" | "https")).ok_or_else(form)?;
    // Also what is written as 0x7f.1 is an address by now.
    let literal = host.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
    match literal {
        Ok(address) if !private && !is_public(address) => Err(AddressRefused::Private(host.to_owned())),
        _ => Ok(url),
    }
}

/// A client for such addresses.
///
/// # Errors
/// If the system has no certificates.
pub(crate) fn client(private: bool) -> Result<Client, reqwest::Error> {
    // An error means that it was said already.
    let _ = rustls::crypto::ring::default_provider().install_default();
    Client::builder()
        .dns_resolver(Arc::new(Guard { private }))
        .redirect(reqwest::redirect::Policy::none())
        // A proxy would look names up by itself.
        .no_proxy()
        .connect_timeout(CONNECT)
        .timeout(TIME)
        .pool_max_idle_per_host(0)
        .user_agent(concat!("gable/", env!("CARGO_PKG_VERSION")))
        .build()
}

/// Gives only addresses that may be asked.
#[derive(Clone, Copy, Debug)]
struct Guard {
    private: bool,
}

impl Resolve for Guard {
    fn resolve(&self, name: Name) -> Resolving {
        let private = self.private;
        Box::pin(async move {
            let found: Vec<SocketAddr> = tokio::net::lookup_host((name.as_str(), 0)).await?.collect();
            // One that is not public among others is no accident.
            if !private && found.iter().any(|a| !is_public(a.ip())) {
                return Err(AddressRefused::Private(name.as_str().to_owned()).into());
            }
            let addresses: Addrs = Box::new(found.into_iter());
            Ok(addresses)
        })
    }
}

/// Whether an address is one of the public internet.
fn is_public(address: IpAddr) -> bool {
    match address {
        IpAddr::V4(a) => is_public_v4(a),
        IpAddr::V6(a) => embedded_v4(a).map_or_else(|| is_public_v6(a), is_public_v4),
    }
}

fn is_public_v4(a: Ipv4Addr) -> bool {
    let [first, second, third, _] = a.octets();
    let special = match (first, second, third) {
        // This network; shared by carriers; protocol assignments; benchmarks; 6to4 relays; reserved, and the broadcast address.
        (0, ..) | (100, 64..=127, _) | (192, 0, 0) | (198, 18..=19, _) | (192, 88, 99) | (240..=255, ..) => true,
        _ => false,
    };
    !(special || a.is_loopback() || a.is_private() || a.is_link_local() || a.is_multicast() || a.is_documentation())
}

/// The IPv4 address that is reached through an IPv6 address: mapped, compatible, by NAT64 and by 6to4.
fn embedded_v4(a: Ipv6Addr) -> Option<Ipv4Addr> {
    let s = a.segments();
    let v4 = |high: u16, low: u16| {
        let ([a, b], [c, d]) = (high.to_be_bytes(), low.to_be_bytes());
        Ipv4Addr::new(a, b, c, d)
    };
    match s {
        [0, 0, 0, 0, 0, 0 | 0xffff, high, low] if !(a.is_loopback() || a.is_unspecified()) => Some(v4(high, low)),
        [0x64, 0xff9b, 0, 0, 0, 0, high, low] => Some(v4(high, low)),
        [0x2002, high, low, ..] => Some(v4(high, low)),
        _ => None,
    }
}

fn is_public_v6(a: Ipv6Addr) -> bool {
    let [first, second, ..] = a.segments();
    // Global unicast is 2000::/3; of it, 2001::/23 is for protocols and 2001:db8::/32 for documentation, as 3fff::/20.
    let global = first & 0xe000 == 0x2000;
    let special = (first == 0x2001 && (second < 0x200 || second == 0xdb8)) || (first == 0x3fff && second < 0x1000);
    global && !special
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_public_addresses_are_asked() {
        let closed = [
            "127.0.0.1",
            "127.9.9.9",
            "10.1.2.3",
            "172.16.0.1",
            "172.31.255.255",
            "192.168.1.1",
            "169.254.169.254",
            "0.0.0.0",
            "100.64.0.1",
            "192.0.0.8",
            "198.18.0.1",
            "224.0.0.1",
            "255.255.255.255",
            "240.0.0.1",
            "203.0.113.9",
            "[::1]",
            "[::]",
            "[fe80::1]",
            "[fc00::1]",
            "[fd12::1]",
            "[ff02::1]",
            "[::ffff:127.0.0.1]",
            "[::ffff:a9fe:a9fe]",
            "[64:ff9b::7f00:1]",
            "[2002:7f00:1::]",
            "[::127.0.0.1]",
            "[2001:db8::1]",
            "[fec0::1]",
            "[100::1]",
            "2130706433",
            "0x7f.1",
            "0177.0.0.1",
            "127.1",
        ];
        for host in closed {
            let url = format!("http://{host}/hook");
            assert!(matches!(checked(&url, false), Err(AddressRefused::Private(_))), "{url}");
            assert!(checked(&url, true).is_ok(), "{url}");
        }
        for host in
            ["93.184.216.34", "[2606:4700::1111]", "100.128.0.1", "172.32.0.1", "example.com", "[64:ff9b::5db8:d822]"]
        {
            assert!(checked(&format!("https://{host}/hook"), false).is_ok(), "{host}");
        }
        for form in [
            "ftp://example.com",
            "https://",
            "file:///etc/passwd",
            "https://me:pw@example.com/",
            "hook",
            "https://a/#b",
        ] {
            assert!(matches!(checked(form, true), Err(AddressRefused::Form(_))), "{form}");
        }
    }

    #[tokio::test]
    async fn a_name_of_this_machine_is_not_asked() {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let port = listener.local_addr().expect("its address").port();
        let url = checked(&format!("http://localhost:{port}/hook"), false).expect("a name can be anything");
        let told = client(false).expect("a client").post(url).send().await.expect_err("it is refused");
        let mut cause: &dyn std::error::Error = &told;
        while let Some(deeper) = cause.source() {
            cause = deeper;
        }
        assert!(cause.to_string().contains("localhost is not a public address"), "{cause}");
        let none = tokio::time::timeout(Duration::from_millis(100), listener.accept()).await;
        assert!(none.is_err(), "nobody has connected");
    }
}
