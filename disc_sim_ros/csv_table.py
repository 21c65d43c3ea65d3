"""CSV files that people type or programs export: rows of cells under the names of columns."""

from collections.abc import Iterator, Mapping, Sequence
import csv
from dataclasses import dataclass, replace
import difflib
import io
from pathlib import Path
import re

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.files import reason
from disc_sim_ros.validation import as_number

SEPARATORS = (',', ';', '\t')
_SEP = re.compile(f'sep=([{"".join(SEPARATORS)}])\\s*', re.IGNORECASE)
_MOST_ROWS = 1_000_000


@dataclass(frozen=True)
class Table:
    """A CSV file with a line of names; commas, semicolons or tabs are between its cells.

    Attributes:
        name: Its name as the user gave it.
        columns: Names of the columns, in their order, each once.
        separator: One of SEPARATORS. Where it is no comma, numbers may have decimal commas.
        lines: All lines but those of comments, with their numbers, the first one that of names.
    """

    name: str
    columns: tuple[str, ...]
    separator: str
    lines: tuple[tuple[int, str], ...]

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield the line number and the cells of each row that is not empty.

        Raises:
            ConfigError: A row has more or fewer cells than the file has columns, or is no CSV.
        """
        width, count = len(self.columns), 0
        for number, cells in _cells(self.name, self.lines[1:], self.separator):
            while len(cells) > width and not cells[-1]:
                cells.pop()
            if not any(cells):
                continue
            count += 1
            if count > _MOST_ROWS:
                allowed = f'at most {_MOST_ROWS} rows'
                raise ConfigError(self.name, f'more than {_MOST_ROWS} rows', allowed)
            if len(cells) != width:
                allowed = f'the head of the file has {width}'
                if len(cells) > width and self.separator == ',':
                    allowed += '; write decimal points, or semicolons between the cells'
                raise ConfigError(f'{self.name}: line {number}', f'{len(cells)} cells', allowed)
            yield number, cells

    def renamed(self, names: Mapping[str, str]) -> 'Table':
        """Return the table with other names of some columns, unless it has these names too."""
        columns = [
            column if names.get(column, column) in self.columns else names[column]
            for column in self.columns
        ]
        return replace(self, columns=tuple(columns))

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, which may be nan or infinite; None if it holds none."""
        text = cell if self.separator == ',' or '.' in cell else cell.replace(',', '.')
        number = as_number(text)
        return number if isinstance(number, float) else None

    def lacks(self, needed: str, missing: Sequence[str], known: Sequence[str]) -> ConfigError:
        """Return the error that columns are missing.

        Args:
            needed: What the file needs, a part of a sentence.
            missing: Their names. The message asks about columns of similar names.
            known: Names of columns that a file may have.
        """
        names = {name.lower(): name for name in missing}
        close = []
        for column in self.columns:
            near = difflib.get_close_matches(column.lower(), names, n=1)
            if near and column not in known:
                close.append(f'{names[near[0]]} for {column}')
        guess = f'; did you mean {", ".join(close)}?' if close else ''
        columns = ', '.join(self.columns)
        return ConfigError(f'{self.name}: columns', columns, f'{needed}{guess}')


def read(path: Path | str, thing: str) -> Table:
    """Return the table in a CSV file, in UTF-8 with or without a byte order mark.

    Cells are stripped; empty rows and lines that begin with `#` are left out. The separator is
    the most frequent of SEPARATORS in the line of names, or that of a first line `sep=;`.

    Args:
        path: The file.
        thing: What the file is to the user, for errors.

    Raises:
        ConfigError: The file cannot be read, is empty, or names a column twice.
    """
    name = str(path)
    try:
        text = Path(path).expanduser().read_text(encoding='utf-8-sig')
    except OSError as error:
        raise ConfigError(thing, name, f'cannot read it ({reason(error)})') from None
    except ValueError:
        raise ConfigError(thing, name, 'cannot read it (it is no text in UTF-8)') from None
    lines = [
        (number, line)
        for number, line in enumerate(io.StringIO(text), 1)
        if line.strip() and not line.startswith('#')
    ]
    separator = ''
    if lines and (hint := _SEP.fullmatch(lines[0][1])):
        separator = hint[1]
        del lines[0]
    if not lines:
        raise ConfigError(thing, name, 'the file is empty')
    separator = separator or max(SEPARATORS, key=lines[0][1].count)
    _, columns = next(_cells(name, lines[:1], separator))
    while len(columns) > 1 and not columns[-1]:
        columns.pop()
    if len(set(columns)) < len(columns):
        raise ConfigError(f'{name}: columns', ', '.join(columns), 'name each column once')
    return Table(name, tuple(columns), separator, tuple(lines))


def _cells(
    name: str, lines: Sequence[tuple[int, str]], separator: str
) -> Iterator[tuple[int, list[str]]]:
    """Yield the number of the first line and the stripped cells of each row."""
    reader = csv.reader(
        (line for _, line in lines), delimiter=separator, skipinitialspace=separator != '\t'
    )
    while True:
        first = reader.line_num
        try:
            cells = next(reader, None)
        except csv.Error as error:  # such as a cell of more than 131072 characters
            number = lines[first][0]
            raise ConfigError(f'{name}: line {number}', lines[first][1], str(error)) from None
        if cells is None:
            return
        yield lines[first][0], [cell.strip() for cell in cells]
