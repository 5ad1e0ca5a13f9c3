//! Connections: how many, how slow they may be, and how they end.

use crate::visitor::Peer;
use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;

/// Most connections at a time; others wait until one ends.
const MOST: usize = 4096;

/// What a client may keep the service waiting for.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Longest time for the head of a request: a client that sends it byte by byte would hold its connection for ever.
    pub head: Duration,
    /// Longest time for requests under way after the service was told to stop.
    pub drain: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { head: Duration::from_secs(10), drain: Duration::from_secs(10) }
    }
}

/// Serves until `stop`, then lets requests under way end.
pub async fn serve(listener: TcpListener, app: Router, patience: Patience, stop: impl Future<Output = ()>) {
    let places = Arc::new(Semaphore::new(MOST));
    let (tell, stopped) = watch::channel(false);
    let mut connections = JoinSet::new();
    tokio::pin!(stop);
    loop {
        let next = async {
            let place = Arc::clone(&places).acquire_owned().await;
            (place, listener.accept().await)
        };
        let (place, accepted) = tokio::select! {
            () = &mut stop => break,
            next = next => next,
        };
        while connections.try_join_next().is_some() {}
        match accepted {
            Ok((stream, peer)) => {
                let served = connection(stream, peer.ip(), app.clone(), patience.head, stopped.clone());
                connections.spawn(async move {
                    served.await;
                    drop(place);
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

async fn connection(stream: TcpStream, peer: IpAddr, app: Router, head: Duration, mut stopped: watch::Receiver<bool>) {
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(head);
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(Peer(peer));
        TowerToHyperService::new(app.clone()).call(request)
    });
    let connection = builder.serve_connection(TokioIo::new(stream), service);
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
