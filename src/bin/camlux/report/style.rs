//! How the page looks, on light and on dark screens.

/// The style sheet. In the dark the plots keep their hues: what is light becomes dark and the reverse.
pub const STYLE: &str = "
:root { color-scheme: light dark; --ink: #222; --faint: #666; --paper: #fff; --line: #ddd; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #ddd; --faint: #999; --paper: #16181c; --line: #3a3d44; }
  svg { filter: invert(0.9) hue-rotate(180deg); }
}
body { max-width: 76rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 system-ui, sans-serif;
  color: var(--ink); background: var(--paper); }
h1, h2, h3 { line-height: 1.2; }
section { margin-top: 3rem; border-top: 1px solid var(--line); }
dl { display: flex; flex-wrap: wrap; gap: 0.5rem 2rem; }
dt { color: var(--faint); font-size: 0.8rem; }
dd { margin: 0; }
figure { margin: 1rem 0; }
figure svg { width: 100%; max-width: 920px; height: auto; display: block; }
figcaption { color: var(--faint); font-size: 0.9rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.8rem; }
th, td { padding: 0.25rem 0.5rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { font-weight: 600; }
tbody th, thead th:first-child { text-align: left; }
.grid { display: flex; flex-wrap: wrap; gap: 1rem; }
.grid figure { margin: 0; }
.grid img { margin-right: 4px; }
img { height: auto; vertical-align: middle; }
";
