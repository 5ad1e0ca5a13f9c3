-- What the program of each task's last attempt said: its last lines, some kilobytes at most. Apart from the tasks, which are
-- read whole at every poll.

CREATE TABLE task_log (
    job     TEXT   NOT NULL,
    stage   BIGINT NOT NULL,
    unit    TEXT   NOT NULL,
    attempt BIGINT NOT NULL,
    log     TEXT   NOT NULL,
    PRIMARY KEY (job, stage, unit),
    FOREIGN KEY (job, stage, unit) REFERENCES task (job, stage, unit) ON DELETE CASCADE
);
