import { useEffect, useState } from 'preact/hooks';
import { get, setToken, signIn, type SignIn } from '../api';

/// Why somebody was not let in, as the service names it; its log tells more.
const WHY: Record<string, string> = {
  denied: 'The provider did not let you in.',
  expired: 'This login was begun elsewhere, or took longer than ten minutes: sign in again.',
  failed: 'The provider could not say who you are: try again; the log of the service tells more.',
  'no-name': 'What the provider says of you has no name that this service can take: ask its operator.',
  'no-role': 'You are in none of the groups that may use this service: ask its operator.',
};

export function Login({ done, why }: { done: () => void; why: string | null }) {
  const [error, setError] = useState('');
  const [provider, setProvider] = useState<string | undefined>();
  useEffect(() => {
    // Without an answer, tokens are all that can be asked for.
    get<SignIn>('/sign-in').then((found) => setProvider(found.provider), () => {});
  }, []);
  const submit = (event: SubmitEvent) => {
    event.preventDefault();
    const form = new FormData(event.currentTarget as HTMLFormElement);
    setToken(String(form.get('token')).trim(), form.get('remember') === 'on');
    get('/caller').then(done, (problem: Error) => {
      setToken(null);
      setError(problem.message);
    });
  };
  return (
    <form class="card login" onSubmit={submit}>
      <h1>{provider ? 'Sign in' : 'Log in'}</h1>
      {why && WHY[why] && <p class="inline-error" role="alert">{WHY[why]}</p>}
      {provider && (
        <>
          <p>You are known to <strong>{provider}</strong>, which tells this service who you are.</p>
          <button class="primary" type="button" onClick={signIn}>Sign in</button>
          <p>Or show a token, as programs do:</p>
        </>
      )}
      {!provider && <p>This service asks for a token. The first start of <code>gable serve</code> told one; an operator makes others with <code>gable token create</code>.</p>}
      <label>
        Token
        <input name="token" type="password" autocomplete="current-password" required autofocus={!provider} aria-describedby="login-error" />
      </label>
      <label class="row">
        <input name="remember" type="checkbox" /> Remember it in this browser
      </label>
      <p id="login-error" class="inline-error" role="alert">{error}</p>
      <button class={provider ? '' : 'primary'}>Log in</button>
    </form>
  );
}
