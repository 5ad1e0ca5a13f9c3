//! Traces by OTLP, where the standard variables name a collector: `OTEL_EXPORTER_OTLP_ENDPOINT` or
//! `OTEL_EXPORTER_OTLP_TRACES_ENDPOINT`; the SDK reads headers, resource, sampler and batches from its other variables.
//!
//! All tasks of a job are in one trace, whichever workers do them: its id is that of the job, so nothing has to be passed around.

use crate::otlp_client::Client;
use opentelemetry::trace::{
    Span as _, SpanBuilder, SpanId, SpanKind, Status, TraceId, Tracer as _, TracerProvider as _,
};
use opentelemetry::{Context, KeyValue};
use opentelemetry_otlp::{ExporterBuildError, SpanExporter, WithHttpConfig as _};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{IdGenerator, RandomIdGenerator, SdkTracer, SdkTracerProvider};
use std::borrow::Cow;
use std::cell::Cell;
use std::fmt;
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::FilterFn;
use tracing_subscriber::layer::Context as Around;
use tracing_subscriber::registry::LookupSpan;

/// How long the end of the service waits for a collector that does not answer.
const PATIENCE: Duration = Duration::from_secs(5);

static PROVIDER: OnceLock<SdkTracerProvider> = OnceLock::new();

/// What sends the service's spans to the collector that the environment names.
///
/// # Errors
/// If its address, or another variable of the exporter, makes no sense.
pub(crate) fn layer<S>() -> Result<impl Layer<S> + Send + Sync, ExporterBuildError>
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    let exporter = SpanExporter::builder().with_http().with_http_client(Client::new()).build()?;
    let provider = SdkTracerProvider::builder()
        .with_batch_exporter(exporter)
        .with_id_generator(Ids::default())
        .with_resource(resource())
        .build();
    let tracer = provider.tracer("gable");
    // Logging is started once.
    PROVIDER.get_or_init(|| provider);
    let own = |metadata: &tracing::Metadata<'_>| metadata.is_span() && metadata.target().starts_with("gable");
    Ok(Spans { tracer }.with_filter(FilterFn::new(own).with_max_level_hint(Level::INFO)))
}

/// Sends what is left.
pub(crate) fn flush() {
    if let Some(provider) = PROVIDER.get()
        && let Err(e) = provider.shutdown_with_timeout(PATIENCE)
    {
        tracing::warn!("the last spans may not have reached the collector: {e}");
    }
}

/// What sends the spans, in the SDK's words; the service's name is `gable` unless the environment has another.
fn resource() -> Resource {
    let found = Resource::builder().build();
    let named = found
        .iter()
        .any(|(key, value)| key.as_str() == "service.name" && !value.as_str().starts_with("unknown_service"));
    let builder = Resource::builder().with_attribute(KeyValue::new("service.version", env!("CARGO_PKG_VERSION")));
    if named { builder.build() } else { builder.with_service_name("gable").build() }
}

thread_local! {
    /// The trace of the span that this thread is about to make.
    static TRACE: Cell<Option<TraceId>> = const { Cell::new(None) };
}

/// Ids of traces that are known beforehand, and random ones.
#[derive(Debug, Default)]
struct Ids(RandomIdGenerator);

impl IdGenerator for Ids {
    fn new_trace_id(&self) -> TraceId {
        TRACE.take().unwrap_or_else(|| self.0.new_trace_id())
    }

    fn new_span_id(&self) -> SpanId {
        self.0.new_span_id()
    }
}

/// The trace of a job: the 128 bits of its id.
fn trace_of(job: &str) -> Option<TraceId> {
    uuid::Uuid::parse_str(job).ok().map(|id| TraceId::from_bytes(id.into_bytes()))
}

/// Makes a span of OpenTelemetry out of each of ours when it ends.
#[derive(Debug)]
struct Spans {
    tracer: SdkTracer,
}

/// What a span has said of itself so far.
#[derive(Debug)]
struct Said {
    begin: SystemTime,
    name: Cow<'static, str>,
    task: bool,
    trace: Option<TraceId>,
    attributes: Vec<KeyValue>,
    error: Option<String>,
    left_out: bool,
}

impl Said {
    fn put(&mut self, field: &Field, value: &str) {
        let key = match field.name() {
            "job" => {
                self.trace = if self.task { trace_of(value) } else { None };
                "gable.job"
            }
            "stage" => {
                self.name = value.to_owned().into();
                "gable.stage"
            }
            "unit" => "gable.unit",
            "worker" => "gable.worker",
            "outcome" => "gable.outcome",
            "reason" => {
                self.error = Some(value.to_owned());
                return;
            }
            "method" => {
                self.name = value.to_owned().into();
                "http.request.method"
            }
            "path" => {
                // What asks every few seconds whether the service lives would be most of all there is.
                self.left_out = matches!(value, "/healthz" | "/readyz" | "/metrics");
                "url.path"
            }
            _ => return,
        };
        self.attributes.push(KeyValue::new(key, value.to_owned()));
    }
}

impl Visit for Said {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        self.put(field, &format!("{value:?}"));
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.put(field, value);
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        if field.name() == "attempt" {
            self.attributes.push(KeyValue::new("gable.attempt", value));
        }
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        if field.name() == "status" {
            self.attributes.push(KeyValue::new("http.response.status_code", i64::try_from(value).unwrap_or(0)));
            if value >= 500 {
                self.error = Some(String::new());
            }
        }
    }
}

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for Spans {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, around: Around<'_, S>) {
        let name = attributes.metadata().name();
        let mut said = Said {
            begin: SystemTime::now(),
            name: name.into(),
            task: name == "task",
            trace: None,
            attributes: Vec::new(),
            error: None,
            left_out: false,
        };
        attributes.record(&mut said);
        if let Some(span) = around.span(id) {
            span.extensions_mut().insert(said);
        }
    }

    fn on_record(&self, id: &Id, values: &Record<'_>, around: Around<'_, S>) {
        if let Some(span) = around.span(id)
            && let Some(said) = span.extensions_mut().get_mut::<Said>()
        {
            values.record(said);
        }
    }

    fn on_close(&self, id: Id, around: Around<'_, S>) {
        let Some(said) = around.span(&id).and_then(|span| span.extensions_mut().remove::<Said>()) else { return };
        if said.left_out {
            return;
        }
        let builder = SpanBuilder::from_name(said.name)
            .with_kind(if said.task { SpanKind::Consumer } else { SpanKind::Server })
            .with_start_time(said.begin)
            .with_attributes(said.attributes);
        TRACE.set(said.trace);
        let mut span = self.tracer.build_with_context(builder, &Context::new());
        TRACE.set(None);
        if let Some(reason) = said.error {
            span.set_status(Status::error(reason));
        }
        span.end();
    }
}
