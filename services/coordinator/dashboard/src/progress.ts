// How far a job is, and how long it may still take.

import type { JobDetail, StageProgress } from './api';

export const STAGES = ['split', 'sample', 'terrain', 'segment', 'stitch', 'model', 'write', 'report'];

/// Shares of the stages in the work of a run, as measured on photographed cities: how much is left has to be guessed before the later
/// stages know their units.
const SHARE: Record<string, number> = {
  split: 0.06, sample: 0.3, terrain: 0.04, segment: 0.22, stitch: 0.03, model: 0.25, write: 0.06, report: 0.04,
};

const total = (p: StageProgress) => p.ready + p.running + p.done + p.failed + p.cancelled;

/// Part of the work that is done, 0 to 1.
export function fraction(job: JobDetail): number {
  if (job.finished && (job.state === 'successful' || job.state === 'partial')) return 1;
  const current = STAGES.indexOf(job.stage);
  let done = 0;
  STAGES.forEach((name, i) => {
    const stage = job.progress.find((p) => p.stage === name);
    if (i < current) done += SHARE[name];
    else if (stage && i === current && total(stage) > 0) {
      done += (SHARE[name] * (stage.done + stage.failed + stage.cancelled)) / total(stage);
    }
  });
  return done;
}

/// Seconds left, if that can be told.
export function left(job: JobDetail, now = Date.now()): number | undefined {
  const done = fraction(job);
  if (!job.started || job.finished || job.state !== 'running' || done < 0.03) return undefined;
  return (((now - Date.parse(job.started)) / 1000) * (1 - done)) / done;
}
