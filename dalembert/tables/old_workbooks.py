"""Hidden rows, hidden columns, percentages and bounds of an .xls workbook, which calamine reads without them.

The file is a compound document ([MS-CFB] §2: header, sectors, directory) whose stream "Workbook" is a row of records
([MS-XLS] §2.4: BoundSheet8, Row, ColInfo, XF, Format, Number, RK, MulRk, Formula).
"""

from __future__ import annotations

from collections.abc import Iterator
from struct import error, unpack_from

ROW, COLUMN, SHEET, STYLE, FORMAT, END = 0x208, 0x7D, 0x85, 0xE0, 0x41E, 0x0A
NUMBER, SHORT, SHORTS, FORMULA = 0x203, 0x27E, 0xBD, 0x06
TEXTS, SPAN = (0xFD, 0x204, 0x205), 0x200
BLANK, BLANKS = 0x201, 0xBE
# how far a sheet can reach
ROWS, COLUMNS = 0x10000, 0x100
# number formats that every workbook has
PERCENT = (9, 10)
# a chain of sectors ends with a number from here on
LAST = 0xFFFFFFFA

Looks = tuple[frozenset[int], frozenset[int], frozenset[tuple[int, int]]]


def looks(data: bytes, name: str) -> Looks:
    """Return the hidden rows, the hidden columns and the percentages of a sheet, all from 0; nothing of a file that is built otherwise."""
    try:
        return _looks(_stream(data), name)
    except (error, IndexError, UnicodeDecodeError):
        return frozenset(), frozenset(), frozenset()


def is_within_bounds(data: bytes) -> bool:
    """Whether no sheet says that it reaches farther than a sheet can: calamine reserves memory for as much as it says."""
    try:
        for kind, body in _records(_stream(data), 0, every_part=True):
            if kind == SPAN and len(body) == 14:
                top, rows, left, columns = unpack_from("<IIHH", body)
                if not (top <= rows <= ROWS and left <= columns <= COLUMNS):
                    return False
            elif (
                kind in (NUMBER, SHORT, SHORTS, FORMULA, *TEXTS) and unpack_from("<H", body, 2)[0] >= COLUMNS
            ):
                return False
    except (error, IndexError, UnicodeDecodeError):
        # calamine says itself what is wrong
        return True
    return True


def reaches(data: bytes) -> list[tuple[int, int, int]]:
    """Return of every part of a workbook how many cells it holds, and up to which row and column."""
    result = [(0, 0, 0)]
    for kind, body in _records(_stream(data), 0, every_part=True):
        if kind == END:
            result.append((0, 0, 0))
        elif kind in (NUMBER, SHORT, SHORTS, FORMULA, *TEXTS, BLANK, BLANKS):
            held, rows, columns = result[-1]
            row, column = unpack_from("<HH", body)
            last = unpack_from("<H", body, len(body) - 2)[0] if kind in (SHORTS, BLANKS) else column
            result[-1] = held + last - column + 1, max(rows, row + 1), max(columns, last + 1)
    return result


def _stream(data: bytes) -> bytes:
    """The stream of the workbook, in which its records stand."""
    shift, small = unpack_from("<HH", data, 30)
    if shift not in (9, 12):
        # no such document
        return b""
    directory, _, limit, first_small, _, further, _ = unpack_from("<7I", data, 48)
    size = 1 << shift

    def sector(number: int) -> bytes:
        return data[(number + 1) << shift : (number + 2) << shift]

    tables = [x for x in unpack_from("<109I", data, 76) if x < LAST]
    met = set()
    while further < LAST and further not in met:
        met.add(further)
        *more, further = unpack_from(f"<{size // 4}I", sector(further))
        tables += [x for x in more if x < LAST]
    following = [x for number in tables for x in unpack_from(f"<{size // 4}I", sector(number))]

    def chain(first: int, after: list[int]) -> Iterator[int]:
        for _ in range(len(after)):
            if first >= LAST:
                return
            yield first
            first = after[first]

    def whole(first: int) -> bytes:
        return b"".join(map(sector, chain(first, following)))

    entries, root = whole(directory), b""
    for at in range(0, len(entries), 128):
        length, kind = unpack_from("<HB", entries, at + 64)
        first, bytes_of = unpack_from("<II", entries, at + 116)
        title = entries[at : at + max(length - 2, 0)].decode("utf-16-le")
        if kind == 5:
            root = whole(first)
        elif title in ("Workbook", "Book"):
            if bytes_of >= limit:
                return whole(first)[:bytes_of]
            table = whole(first_small)
            after = list(unpack_from(f"<{len(table) // 4}I", table))
            parts = (root[k << small : (k + 1) << small] for k in chain(first, after))
            return b"".join(parts)[:bytes_of]
    return b""


def _records(stream: bytes, at: int, every_part: bool = False) -> Iterator[tuple[int, bytes]]:
    """The records from a place on, up to the end of their part or through every part: kind and contents."""
    while at + 4 <= len(stream):
        kind, length = unpack_from("<HH", stream, at)
        if kind == END and not every_part:
            return
        yield kind, stream[at + 4 : at + 4 + length]
        at += 4 + length


def _text(body: bytes, at: int, count: int) -> str:
    """A string of this number of characters: a byte that says how wide they are, and they."""
    wide = body[at] & 1
    return body[at + 1 : at + 1 + (count << wide)].decode("utf-16-le" if wide else "latin-1")


def _looks(stream: bytes, name: str) -> Looks:
    start, styles, percent = None, list[int](), set(PERCENT)
    for kind, body in _records(stream, 0):
        if kind == SHEET and _text(body, 7, body[6]) == name:
            (start,) = unpack_from("<I", body)
        elif kind == STYLE:
            styles.append(unpack_from("<H", body, 2)[0])
        elif kind == FORMAT:
            number, count = unpack_from("<HH", body)
            if "%" in _text(body, 4, count):
                percent.add(number)
    rows, columns, places = set[int](), set[int](), set[tuple[int, int]]()
    for kind, body in () if start is None else _records(stream, start):
        if kind == ROW and unpack_from("<H", body, 12)[0] & 0x20:
            rows.add(unpack_from("<H", body)[0])
        elif kind == COLUMN and body[8] & 1:
            low, high = unpack_from("<HH", body)
            columns |= set(range(low, min(high, 255) + 1))
        elif kind in (NUMBER, SHORT, FORMULA):
            row, column, style = unpack_from("<HHH", body)
            # a formula whose value is a text or an error says so in the last bytes of its value
            value = kind != FORMULA or body[12:14] != b"\xff\xff"
            if value and styles[style] in percent:
                places.add((row, column))
        elif kind == SHORTS:
            row, column = unpack_from("<HH", body)
            for k in range((len(body) - 6) // 6):
                if styles[unpack_from("<H", body, 4 + 6 * k)[0]] in percent:
                    places.add((row, column + k))
    return frozenset(rows), frozenset(columns), frozenset(places)
