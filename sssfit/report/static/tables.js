// Tables that sort by a column and copy as CSV, and buttons that copy a text.

const valueOf = (row, column) => {
  const { value } = row.cells[column].dataset;
  return value === '' ? null : Number.isNaN(Number(value)) ? value : Number(value);
};

const before = (a, b) => {
  if (a === null || b === null) return (a === null) - (b === null); // what is missing comes last
  return typeof a === 'number' && typeof b === 'number' ? a - b : String(a).localeCompare(String(b));
};

function sortBy(table, column, head) {
  const falls = head.getAttribute('aria-sort') === 'ascending';
  for (const each of table.tHead.rows[0].cells) each.removeAttribute('aria-sort');
  head.setAttribute('aria-sort', falls ? 'descending' : 'ascending');
  const rows = [...table.tBodies[0].rows].sort((a, b) => {
    const [one, other] = [valueOf(a, column), valueOf(b, column)];
    return one === null || other === null || !falls ? before(one, other) : before(other, one);
  });
  table.tBodies[0].append(...rows);
}

const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

export const csvOf = (table) => [...table.rows].map((row) => [...row.cells]
  .map((cell) => quoted(cell.dataset.value ?? cell.textContent.trim())).join(',')).join('\n') + '\n';

// Copies a text and says so; a page that may not use the clipboard selects it to be copied by hand.
export async function copy(text, button, status) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = document.createElement('textarea');
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand('copy');
    area.remove();
    button.focus();
  }
  status.textContent = `Copied ${text.length.toLocaleString('en')} characters.`;
}

export function startTables(status) {
  for (const table of document.querySelectorAll('table.sorts')) {
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      head.querySelector('button').addEventListener('click', () => sortBy(table, column, head));
    });
    const button = document.querySelector(`[data-csv="${table.id}"]`);
    button.addEventListener('click', () => copy(csvOf(table), button, status));
  }
}
