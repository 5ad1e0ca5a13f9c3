for (const figure of document.querySelectorAll('figure')) figure.onclick = () => figure.classList.toggle('wide');

// Tables sort by the column whose heading is clicked; a second click turns the order round.
for (const table of document.querySelectorAll('table.sortable')) {
  const heads = [...table.rows[0].cells];
  heads.forEach((head, column) => {
    head.tabIndex = 0;
    const sort = () => {
      const down = head.getAttribute('aria-sort') === 'ascending';
      heads.forEach((other) => other.removeAttribute('aria-sort'));
      head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      const value = (row) => row.cells[column].textContent.trim();
      const order = (a, b) => {
        const [x, y] = [value(a), value(b)];
        const [u, v] = [parseFloat(x), parseFloat(y)];
        const numbers = !head.classList.contains('text');
        if (numbers && (isNaN(u) || isNaN(v))) return (isNaN(u) ? 1 : 0) - (isNaN(v) ? 1 : 0);
        const result = numbers ? u - v : x.localeCompare(y, 'en', { numeric: true });
        return down ? -result : result;
      };
      const rows = [...table.rows].slice(1).sort(order);
      rows.forEach((row) => row.parentNode.append(row));
    };
    head.onclick = sort;
    head.onkeydown = (event) => { if (event.key === 'Enter') sort(); };
  });
}
