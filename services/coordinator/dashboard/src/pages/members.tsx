// Whose a city is: its members, for its owners to change; and going back to an earlier generation.

import { useState } from 'preact/hooks';
import { type Generation, ROLES, type Member, type Role, send } from '../api';
import { useCaller } from '../caller';
import { Action, Columns, Failure, useGet } from '../ui';

const pathOf = (city: string) => `/cities/${encodeURIComponent(city)}`;

/// Whether the caller owns a city. Groups of the caller are not known here: the service has the last word.
export function useOwns(members: Member[] | undefined): boolean {
  const { caller } = useCaller();
  if (!caller || caller.scope === 'viewer') return false;
  return caller.scope === 'operator' || !!members?.some((m) => m.role === 'owner' && (m.name === caller.name || m.name.startsWith('group:')));
}

export function Members({ city }: { city: string }) {
  const { value, error, again } = useGet<Member[]>(`${pathOf(city)}/members`);
  const owns = useOwns(value);
  const [name, setName] = useState('');
  const [role, setRole] = useState<Role>('viewer');
  const place = (member: string) => `${pathOf(city)}/members/${encodeURIComponent(member)}`;
  const set = (member: string, wanted: Role) => send<Member[]>('PUT', place(member), { role: wanted }).then(again);
  if (error) return <Failure error={error} retry={again} />;
  if (!value) return null;
  return (
    <section class="card" aria-labelledby="members-title">
      <h2 id="members-title">Members</h2>
      <div class="scroll">
        <table class="stacked">
          <Columns names={['Name', 'Role', '']} />
          <tbody>
            {value.map((m) => (
              <tr key={m.name}>
                <th scope="row">{m.name}</th>
                <td data-label="Role">{m.role}</td>
                <td class="actions">{owns && <Action label="Remove" run={() => send('DELETE', place(m.name)).then(again)} />}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      {owns && (
        <p class="actions">
          <label class="row">Name <input name="member" value={name} placeholder="a token, or group:NAME" onInput={(e) => setName(e.currentTarget.value)} /></label>
          <label class="row">Role
            <select name="role" value={role} onChange={(e) => setRole(e.currentTarget.value as Role)}>
              {ROLES.map((r) => <option key={r}>{r}</option>)}
            </select>
          </label>
          <Action label="Share" run={() => (name.trim() ? set(name.trim(), role).then(() => setName('')) : Promise.resolve())} />
        </p>
      )}
    </section>
  );
}

/// Deletes an earlier generation, once it was asked for twice.
export function DeleteGeneration({ city, generation, then }: { city: string; generation: number; then: () => void }) {
  const [sure, ask] = useState(false);
  if (!sure) return <button onClick={() => ask(true)}>Delete</button>;
  return (
    <>
      <Action label={`Delete ${generation} for good`} run={() => send('DELETE', `${pathOf(city)}/generations/${generation}`).then(then)} />
      <button onClick={() => ask(false)}>No</button>
    </>
  );
}

/// Deletes a city, once its name was typed.
export function DeleteCity({ city }: { city: string }) {
  const [name, setName] = useState('');
  const run = () => send('DELETE', `${pathOf(city)}?confirm=${encodeURIComponent(name)}`).then(() => { location.hash = '#/cities'; });
  return (
    <details class="card">
      <summary>Delete this city</summary>
      <p>With its generations, jobs and members. Nothing of it can be had back.</p>
      <p class="actions">
        <label class="row">Its name <input name="confirm" value={name} autocomplete="off" onInput={(e) => setName(e.currentTarget.value)} /></label>
        {name === city && <Action label={`Delete ${city} for good`} run={run} />}
      </p>
    </details>
  );
}

/// Publishes an earlier generation anew, once it was asked for twice.
export function RollBack({ city, generation, then }: { city: string; generation: number; then: () => void }) {
  const [sure, ask] = useState(false);
  if (!sure) return <button onClick={() => ask(true)}>Roll back to it</button>;
  const run = () => send<Generation>('POST', `${pathOf(city)}/roll-back`, { generation }).then(then);
  return (
    <>
      <Action label={`Publish ${generation} again`} kind="primary" run={run} />
      <button onClick={() => ask(false)}>No</button>
    </>
  );
}
