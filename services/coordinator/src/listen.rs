//! Connections: how many, how slow they may be, and how they end.

use crate::visitor::{Peer, TrustedProxy, is_trusted};
use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;
use tokio_io_timeout::TimeoutStream;

/// How often it is said that connections of an address are closed.
const SAID: Duration = Duration::from_secs(60);

/// What a client may keep the service waiting for.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Longest time for the head of a request: a client that sends it byte by byte would hold its connection for ever.
    pub head: Duration,
    /// Longest time in which a client takes nothing of what is sent to it.
    pub taking: Duration,
    /// Longest time for requests under way after the service was told to stop.
    pub drain: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        let seconds = Duration::from_secs;
        Self { head: seconds(10), taking: seconds(60), drain: seconds(10) }
    }
}

/// How many connections there may be at a time.
#[derive(Clone, Debug)]
pub struct Places {
    /// All together; others wait until one ends.
    pub all: usize,
    /// Of one address: others are closed. An IPv6 address counts as its network of 64 bits, of which one machine has all.
    pub of_address: usize,
    /// Proxies, which stand for many clients: they are not counted by address.
    pub proxies: Vec<TrustedProxy>,
}

impl Default for Places {
    fn default() -> Self {
        Self { all: 4096, of_address: 256, proxies: Vec::new() }
    }
}

/// Connections by address. Clones share them.
#[derive(Clone, Debug, Default)]
struct Addresses(Arc<Mutex<Counted>>);

#[derive(Debug, Default)]
struct Counted {
    connections: HashMap<IpAddr, usize>,
    /// When it was last said that connections are closed.
    said: Option<Instant>,
}

/// A connection that is counted until this is dropped.
#[derive(Debug)]
struct Seat {
    addresses: Addresses,
    address: IpAddr,
}

impl Addresses {
    /// A seat for a connection; none if the address has as many as it may.
    fn seat(&self, peer: IpAddr, places: &Places) -> Option<Seat> {
        let address = counted_as(peer);
        let mut counted = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let now = counted.connections.get(&address).copied().unwrap_or(0);
        if now >= places.of_address && !is_trusted(&places.proxies, peer) {
            if counted.said.is_none_or(|said| said.elapsed() >= SAID) {
                counted.said = Some(Instant::now());
                tracing::warn!(
                    address = %address,
                    connections = now,
                    "an address has as many connections as it may, and further ones are closed; a proxy is named by --trusted-proxy"
                );
            }
            return None;
        }
        *counted.connections.entry(address).or_default() += 1;
        Some(Seat { addresses: self.clone(), address })
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut counted = self.addresses.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(connections) = counted.connections.get_mut(&self.address) {
            *connections -= 1;
            if *connections == 0 {
                counted.connections.remove(&self.address);
            }
        }
    }
}

/// The address under which a client is counted.
fn counted_as(peer: IpAddr) -> IpAddr {
    match peer.to_canonical() {
        IpAddr::V6(address) => {
            let network = u128::from(address) >> 64 << 64;
            IpAddr::V6(Ipv6Addr::from(network))
        }
        address @ IpAddr::V4(_) => address,
    }
}

/// Serves until `stop`, then lets requests under way end.
pub async fn serve(
    listener: TcpListener,
    app: Router,
    patience: Patience,
    places: Places,
    stop: impl Future<Output = ()>,
) {
    let room = Arc::new(Semaphore::new(places.all));
    let addresses = Addresses::default();
    let (tell, stopped) = watch::channel(false);
    let mut connections = JoinSet::new();
    tokio::pin!(stop);
    loop {
        let next = async {
            let place = Arc::clone(&room).acquire_owned().await;
            (place, listener.accept().await)
        };
        let (place, accepted) = tokio::select! {
            () = &mut stop => break,
            next = next => next,
        };
        while connections.try_join_next().is_some() {}
        match accepted {
            Ok((stream, peer)) => {
                let Some(seat) = addresses.seat(peer.ip(), &places) else { continue };
                let served = connection(stream, peer.ip(), app.clone(), patience, stopped.clone());
                connections.spawn(async move {
                    served.await;
                    drop((place, seat));
                });
            }
            // Out of descriptors, or the client has gone: others may do better.
            Err(e) => {
                tracing::warn!("a connection was not taken: {e}");
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        }
    }
    drop(listener);
    tell.send_replace(true);
    let ended = async { while connections.join_next().await.is_some() {} };
    if tokio::time::timeout(patience.drain, ended).await.is_err() {
        tracing::info!("clients that still wait are cut off");
    }
}

async fn connection(
    stream: TcpStream,
    peer: IpAddr,
    app: Router,
    patience: Patience,
    mut stopped: watch::Receiver<bool>,
) {
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(patience.head);
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(Peer(peer));
        TowerToHyperService::new(app.clone()).call(request)
    });
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(patience.taking));
    let connection = builder.serve_connection(TokioIo::new(Box::pin(stream)), service);
    let told = async {
        let _ = stopped.wait_for(|&s| s).await;
    };
    tokio::pin!(connection);
    let ended = tokio::select! {
        ended = &mut connection => ended,
        () = told => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(e) = ended {
        tracing::debug!("a connection ended: {e}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_counted_as_one_address() {
        let counted = |text: &str| counted_as(text.parse().unwrap()).to_string();
        assert_eq!(counted("203.0.113.7"), "203.0.113.7");
        assert_eq!(counted("::ffff:203.0.113.7"), "203.0.113.7");
        assert_eq!(counted("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::");
    }

    #[test]
    fn seats_are_free_again() {
        let (addresses, places) = (Addresses::default(), Places { of_address: 2, ..Places::default() });
        let (one, other) = ("203.0.113.7".parse().unwrap(), "203.0.113.8".parse().unwrap());
        let seats = [addresses.seat(one, &places), addresses.seat(one, &places)];
        assert!(seats.iter().all(Option::is_some) && addresses.seat(one, &places).is_none());
        assert!(addresses.seat(other, &places).is_some());
        drop(seats);
        assert!(addresses.seat(one, &places).is_some());
        assert!(addresses.0.lock().unwrap().connections.is_empty(), "nothing is kept of those that are gone");
        let behind = Places { proxies: vec!["203.0.113.0/24".parse().unwrap()], of_address: 0, ..Places::default() };
        assert!(addresses.seat(one, &behind).is_some());
    }
}
