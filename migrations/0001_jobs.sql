-- Jobs, their tasks, and what the tasks made. The same statements run on SQLite and Postgres:
-- times are milliseconds since 1970 by the database's clock, flags are 0 or 1, documents are JSON as text.

CREATE TABLE job (
    id              TEXT   NOT NULL PRIMARY KEY,
    city            TEXT   NOT NULL,
    owner           TEXT   NOT NULL,
    idempotency_key TEXT,
    request         TEXT   NOT NULL,
    state           TEXT   NOT NULL,
    reason          TEXT,
    priority        BIGINT NOT NULL,
    -- Tasks of this stage may run; those of later stages wait.
    stage           BIGINT NOT NULL,
    -- Number of the job's last event. Every change of a job or its tasks raises it first, which locks the row and
    -- so puts the changes of one job in one order.
    events          BIGINT NOT NULL,
    created         BIGINT NOT NULL,
    started         BIGINT,
    finished        BIGINT,
    UNIQUE (owner, idempotency_key)
);

CREATE INDEX job_by_state ON job (state, priority, created);
CREATE INDEX job_by_creation ON job (created, id);
CREATE INDEX job_by_city ON job (city, created);

CREATE TABLE task (
    job          TEXT   NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    stage        BIGINT NOT NULL,
    unit         TEXT   NOT NULL,
    input        TEXT   NOT NULL,
    -- The job cannot go on without it.
    required     BIGINT NOT NULL,
    state        TEXT   NOT NULL,
    attempts     BIGINT NOT NULL,
    max_attempts BIGINT NOT NULL,
    -- Raised at each claim: who holds an older number has lost the task.
    fence        BIGINT NOT NULL,
    worker       TEXT,
    phase        TEXT,
    reason       TEXT,
    not_before   BIGINT NOT NULL,
    lease_until  BIGINT,
    started      BIGINT,
    finished     BIGINT,
    PRIMARY KEY (job, stage, unit)
);

CREATE INDEX task_by_state ON task (job, state, stage, unit);
CREATE INDEX task_by_lease ON task (state, lease_until);

-- Which content lies under which path of a job; the content itself is in the object store under its hash.
CREATE TABLE artifact (
    job   TEXT   NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    path  TEXT   NOT NULL,
    blob  TEXT   NOT NULL,
    bytes BIGINT NOT NULL,
    PRIMARY KEY (job, path)
);

CREATE INDEX artifact_by_blob ON artifact (blob);

CREATE TABLE event (
    job     TEXT   NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    number  BIGINT NOT NULL,
    at      BIGINT NOT NULL,
    kind    TEXT   NOT NULL,
    stage   BIGINT,
    unit    TEXT,
    message TEXT,
    PRIMARY KEY (job, number)
);

CREATE TABLE worker (
    id      TEXT   NOT NULL PRIMARY KEY,
    host    TEXT   NOT NULL,
    pid     BIGINT NOT NULL,
    version TEXT   NOT NULL,
    started BIGINT NOT NULL,
    seen    BIGINT NOT NULL,
    task    TEXT,
    memory  BIGINT NOT NULL
);
