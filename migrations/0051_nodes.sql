-- Which worker processes can do which task: a node is a process of gable work or gable serve --all, with all of its slots.

ALTER TABLE worker ADD COLUMN node TEXT NOT NULL DEFAULT '';
-- Most memory that a task may use there, bytes.
ALTER TABLE worker ADD COLUMN task_memory BIGINT NOT NULL DEFAULT 0;
-- Why it takes no tasks, if it takes none.
ALTER TABLE worker ADD COLUMN trouble TEXT;

CREATE INDEX worker_by_time ON worker (seen);

-- How often its lease ran out: those attempts do not count among the others.
ALTER TABLE task ADD COLUMN losses BIGINT NOT NULL DEFAULT 0;
-- Memory that it is known to need, bytes: more than an attempt had that needed more.
ALTER TABLE task ADD COLUMN needs_memory BIGINT NOT NULL DEFAULT 0;

-- Nodes that have tried a task and failed (failed), or that lack what it needs (unfit).
CREATE TABLE task_node (
    job   TEXT   NOT NULL,
    stage BIGINT NOT NULL,
    unit  TEXT   NOT NULL,
    node  TEXT   NOT NULL,
    what  TEXT   NOT NULL,
    at    BIGINT NOT NULL,
    PRIMARY KEY (job, stage, unit, node),
    FOREIGN KEY (job, stage, unit) REFERENCES task (job, stage, unit) ON DELETE CASCADE
);

CREATE INDEX task_node_by_time ON task_node (what, at);
