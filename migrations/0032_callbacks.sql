-- Receivers that are told of one job only, in the words of OGC API - Processes.

-- NULL for the webhooks that an operator has made.
ALTER TABLE webhook ADD COLUMN job TEXT REFERENCES job (id) ON DELETE CASCADE;
-- The address of the service as the client of that job sees it: links in messages begin with it.
ALTER TABLE webhook ADD COLUMN base TEXT;

CREATE INDEX webhook_by_job ON webhook (job);
