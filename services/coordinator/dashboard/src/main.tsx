import { render } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import { ApiError, type Caller, get, returned, setToken, signOut, token, whenUnauthorised } from './api';
import { CallerContext } from './caller';
import { Cities } from './pages/cities';
import { CityPage } from './pages/city';
import { JobPage } from './pages/job';
import { Jobs } from './pages/jobs';
import { Login } from './pages/login';
import { Schedules } from './pages/schedules';
import { Submit } from './pages/submit';
import { View } from './pages/view';
import { Workers } from './pages/workers';
import { link, useRoute } from './router';
import { Empty, Failure, Loading } from './ui';
import './style.css';

const PAGES = [
  ['jobs', 'Jobs'],
  ['submit', 'New job'],
  ['cities', 'Cities'],
  ['schedules', 'Schedules'],
  ['workers', 'Workers'],
];

type Theme = 'auto' | 'light' | 'dark';

function useTheme(): [Theme, () => void] {
  const [theme, set] = useState<Theme>((localStorage.getItem('gable.theme') as Theme) ?? 'auto');
  useEffect(() => {
    if (theme === 'auto') delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    localStorage.setItem('gable.theme', theme);
  }, [theme]);
  return [theme, () => set(theme === 'auto' ? 'dark' : theme === 'dark' ? 'light' : 'auto')];
}

function Page() {
  const route = useRoute();
  const [name, id, more] = route.path;
  useEffect(() => {
    document.title = [...route.path.filter((part) => part !== 'jobs' || route.path.length === 1), 'gable'].join(' · ');
  }, [route]);
  switch (name) {
    case undefined:
    case 'jobs':
      if (!id) return <Jobs route={route} />;
      return more === 'view' ? <View route={route} /> : <JobPage key={id} id={id} route={route} />;
    case 'submit':
      return <Submit route={route} />;
    case 'cities':
      if (!id) return <Cities />;
      return more === 'view' ? <View route={route} /> : <CityPage key={id} name={id} route={route} />;
    case 'schedules':
      return <Schedules />;
    case 'workers':
      return <Workers />;
    default:
      return (
        <Empty title="There is no such page">
          Go to the <a href={link(['jobs'])}>list of jobs</a>.
        </Empty>
      );
  }
}

function App() {
  const route = useRoute();
  const [theme, turn] = useTheme();
  const [caller, setCaller] = useState<Caller | null>(null);
  const [login, askLogin] = useState(false);
  const [error, setError] = useState<Error | null>(null);
  const who = () => {
    setError(null);
    get<Caller>('/caller').then(
      (found) => {
        setCaller(found);
        askLogin(false);
        if (found.signed_in) returned();
      },
      (problem) => {
        if (problem instanceof ApiError && problem.status === 401) askLogin(true);
        else setError(problem);
      },
    );
  };
  useEffect(() => {
    whenUnauthorised(() => askLogin(true));
    who();
  }, []);
  const leave = async () => {
    if (caller?.signed_in) {
      try {
        await signOut();
      } catch (problem) {
        return setError(problem as Error);
      }
    }
    setToken(null);
    setCaller(null);
    askLogin(true);
  };
  const here = route.path[0] ?? 'jobs';
  return (
    <CallerContext.Provider value={caller}>
      <a class="skip" href="#main" onClick={(e) => { e.preventDefault(); document.getElementById('main')?.focus(); }}>
        Skip to content
      </a>
      <header>
        <a class="brand" href={link(['jobs'])} aria-label="gable, list of jobs">
          <svg viewBox="0 0 16 16" width="22" height="22" aria-hidden="true">
            <path d="M1 8l7-6 7 6h-2v6H3V8z" fill="currentColor" />
          </svg>
          gable
        </a>
        <nav aria-label="Pages">
          {PAGES.map(([path, title]) => (
            <a key={path} href={link([path])} aria-current={here === path ? 'page' : undefined}>
              {title}
            </a>
          ))}
        </nav>
        <div class="tools">
          {caller && (
            <span class="who" title={`Scope: ${caller.scope}`}>
              {caller.name} <small>{caller.scope}</small>
            </span>
          )}
          {(token() || caller?.signed_in) && (
            <button class="quiet" onClick={leave}>
              {caller?.signed_in ? 'Sign out' : 'Log out'}
            </button>
          )}
          <button class="quiet" onClick={turn} aria-label={`Colours: ${theme}. Change`} title={`Colours: ${theme}`}>
            <span aria-hidden="true">{theme === 'auto' ? '◑' : theme === 'dark' ? '●' : '○'}</span>
          </button>
        </div>
      </header>
      <main id="main" tabIndex={-1}>
        {login ? <Login done={who} why={route.query.get('sign-in')} /> : error ? <Failure error={error} retry={who} /> : caller ? <Page /> : <Loading what="the service" />}
      </main>
    </CallerContext.Provider>
  );
}

render(<App />, document.getElementById('app')!);
