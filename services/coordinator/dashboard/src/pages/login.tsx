import { useState } from 'preact/hooks';
import { get, setToken } from '../api';

export function Login({ done }: { done: () => void }) {
  const [error, setError] = useState('');
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
      <h1>Log in</h1>
      <p>This service asks for a token. The first start of <code>gable serve</code> told one; an operator makes others with <code>gable token create</code>.</p>
      <label>
        Token
        <input name="token" type="password" autocomplete="current-password" required autofocus aria-describedby="login-error" />
      </label>
      <label class="row">
        <input name="remember" type="checkbox" /> Remember it in this browser
      </label>
      <p id="login-error" class="inline-error" role="alert">{error}</p>
      <button class="primary">Log in</button>
    </form>
  );
}
