// Who looks at the page, and what they may do.

import { createContext } from 'preact';
import { useContext } from 'preact/hooks';
import type { Caller } from './api';

export const CallerContext = createContext<Caller | null>(null);

export function useCaller() {
  const caller = useContext(CallerContext);
  return {
    caller,
    maySubmit: caller !== null && caller.scope !== 'viewer',
    /// Operators steer all jobs, submitters their own.
    maySteer: (owner: string) =>
      caller !== null && (caller.scope === 'operator' || (caller.scope === 'submitter' && caller.name === owner)),
  };
}
