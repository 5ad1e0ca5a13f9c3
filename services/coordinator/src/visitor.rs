//! From where a request comes, and where the service is for whoever asks.
//!
//! A proxy says both in headers that anybody may send, so they are believed of the addresses of known proxies only
//! (`gable serve --trusted-proxy`).

use crate::Coordinator;
use crate::base::Base;
use axum::extract::{FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::Response;
use ipnet::IpNet;
use std::convert::Infallible;
use std::net::{AddrParseError, IpAddr, SocketAddr};
use std::str::FromStr;

/// Longest prefix of addresses that a proxy may say, bytes.
const LONGEST_PREFIX: usize = 200;

/// Addresses of proxies whose word is taken for from where a request comes: one, or a network such as `10.0.0.0/8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrustedProxy(IpNet);

impl FromStr for TrustedProxy {
    type Err = AddrParseError;

    fn from_str(text: &str) -> Result<Self, AddrParseError> {
        match text.parse::<IpNet>() {
            Ok(network) => Ok(Self(network)),
            Err(_) => Ok(Self(text.parse::<IpAddr>()?.into())),
        }
    }
}

/// The proxies that are believed.
pub(crate) fn is_trusted(proxies: &[TrustedProxy], address: IpAddr) -> bool {
    proxies.iter().any(|proxy| proxy.0.contains(&address))
}

/// The other end of the connection on which a request came.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer(pub(crate) IpAddr);

/// Who asks from where, and under which address they see the service.
#[derive(Clone, Debug)]
pub(crate) struct Visitor {
    /// The client, or the first on the way to it that no known proxy stands for.
    pub(crate) address: Option<IpAddr>,
    pub(crate) base: Base,
}

impl<S: Sync> FromRequestParts<S> for Base {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let visitor = parts.extensions.get::<Visitor>();
        Ok(visitor.map_or_else(|| base(&parts.headers, false), |visitor| visitor.base.clone()))
    }
}

/// Finds out who asks, and answers with addresses as they see them.
pub(crate) async fn look(State(service): State<Coordinator>, mut request: Request, next: Next) -> Response {
    let peer = request.extensions().get::<Peer>().map(|peer| peer.0.to_canonical());
    let trusted = peer.is_some_and(|peer| is_trusted(&service.proxies, peer));
    let address = peer.map(|peer| client(&service.proxies, peer, request.headers()));
    let base = base(request.headers(), trusted);
    request.extensions_mut().insert(Visitor { address, base: base.clone() });
    let mut response = next.run(request).await;
    if !base.prefix.is_empty()
        && let Some(place) = response.headers().get(header::LOCATION).and_then(|v| v.to_str().ok())
        && place.starts_with('/')
        && let Ok(place) = HeaderValue::from_str(&format!("{}{place}", base.prefix))
    {
        response.headers_mut().insert(header::LOCATION, place);
    }
    response
}

/// The client of a request: each proxy adds to the right from where it was asked, so the first from the right that is no known proxy.
fn client(proxies: &[TrustedProxy], peer: IpAddr, headers: &HeaderMap) -> IpAddr {
    let mut found = peer;
    let said: Vec<&str> = headers.get_all("x-forwarded-for").iter().filter_map(|v| v.to_str().ok()).collect();
    let mut said = said.iter().flat_map(|list| list.split(',')).rev();
    while is_trusted(proxies, found) {
        let Some(before) = said.next().and_then(|text| address(text.trim())) else { break };
        found = before;
    }
    found
}

/// An address, with a port or without.
fn address(text: &str) -> Option<IpAddr> {
    let bare = text.strip_prefix('[').and_then(|t| t.strip_suffix(']')).unwrap_or(text);
    let found = bare.parse::<IpAddr>().ok().or_else(|| text.parse::<SocketAddr>().ok().map(|a| a.ip()));
    found.map(|address| address.to_canonical())
}

/// Where the service is for whoever asks.
fn base(headers: &HeaderMap, trusted: bool) -> Base {
    let text = |name: &str| headers.get(name).and_then(|v| v.to_str().ok());
    // The last that is said is of the proxy that asks; what stands before that others have said to it.
    let forwarded = |name: &str| text(name).filter(|_| trusted).and_then(|v| v.rsplit(',').next()).map(str::trim);
    let scheme = if forwarded("x-forwarded-proto") == Some("https") { "https" } else { "http" };
    let host = forwarded("x-forwarded-host").or_else(|| text(header::HOST.as_str()));
    let plain =
        |host: &&str| !host.is_empty() && host.chars().all(|c| c.is_ascii_alphanumeric() || ".-_:[]".contains(c));
    let prefix = forwarded("x-forwarded-prefix").map(|prefix| prefix.trim_end_matches('/')).filter(|p| is_prefix(p));
    Base {
        scheme,
        host: host.filter(plain).unwrap_or("localhost").to_owned(),
        prefix: prefix.unwrap_or_default().to_owned(),
    }
}

/// Whether a text may stand before paths: it could lead to another host otherwise.
fn is_prefix(text: &str) -> bool {
    let plain = |part: &str| {
        !part.is_empty()
            && !matches!(part, "." | "..")
            && part.chars().all(|c| c.is_ascii_alphanumeric() || "-._~".contains(c))
    };
    text.len() <= LONGEST_PREFIX && text.strip_prefix('/').is_some_and(|rest| rest.split('/').all(plain))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(list: &[(&'static str, &'static str)]) -> HeaderMap {
        list.iter().map(|(name, value)| ((*name).parse().unwrap(), HeaderValue::from_static(value))).collect()
    }

    fn proxies(list: &[&str]) -> Vec<TrustedProxy> {
        list.iter().map(|text| text.parse().unwrap()).collect()
    }

    #[test]
    fn the_client_is_the_first_that_no_known_proxy_stands_for() {
        let known = proxies(&["10.0.0.0/8", "::1"]);
        let of = |peer: &str, said: &'static str| {
            client(&known, peer.parse().unwrap(), &headers(&[("x-forwarded-for", said)])).to_string()
        };
        assert_eq!(of("203.0.113.7", "1.2.3.4"), "203.0.113.7", "anybody may send the header");
        assert_eq!(of("10.0.0.1", "1.2.3.4"), "1.2.3.4");
        assert_eq!(of("10.0.0.1", "6.6.6.6, 1.2.3.4, 10.2.2.2"), "1.2.3.4", "what the client has sent itself");
        assert_eq!(of("::1", "[2001:db8::1]:443"), "2001:db8::1");
        assert_eq!(of("::1", "1.2.3.4:80"), "1.2.3.4");
        assert_eq!(of("::1", "unknown"), "::1");
        assert_eq!(of("10.0.0.1", "10.0.0.2"), "10.0.0.2");
    }

    #[test]
    fn proxies_say_where_the_service_is_if_they_are_known() {
        let said = headers(&[
            ("host", "inner:8080"),
            ("x-forwarded-proto", "https"),
            ("x-forwarded-host", "city.example"),
            ("x-forwarded-prefix", "/gable/"),
        ]);
        assert_eq!(base(&said, true).href("/ogc"), "https://city.example/gable/ogc");
        assert_eq!(base(&said, false).href("/ogc"), "http://inner:8080/ogc");
        for odd in
            ["//evil.example", "/a/../b", "gable", "/a//b", "/a\"b", "/a b", "/\\evil.example", "https://evil.example"]
        {
            let said = headers(&[("host", "h"), ("x-forwarded-prefix", odd)]);
            assert_eq!(base(&said, true).href("/x"), "http://h/x", "{odd}");
        }
        assert_eq!(base(&headers(&[("host", "a\"><script>")]), true).href("/x"), "http://localhost/x");
    }

    #[test]
    fn a_base_is_kept_as_text() {
        for text in ["https://city.example/gable", "http://h:8080", "http://h/a/b"] {
            assert_eq!(Base::kept(text).href(""), text);
        }
    }
}
