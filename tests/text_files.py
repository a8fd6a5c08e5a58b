"""Tables in text as instruments and spreadsheets write them: read back by Python's csv module, or stated."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from record_case import Case, Held

STEP = 2e-5
T = STEP * np.arange(40)
V = np.round(5.0 * np.sin(2 * np.pi * 900 * T), 4)
U = np.round(3.0 * np.cos(2 * np.pi * 900 * T), 4)
HELD = Held({"tip": ("m/s", 1e-3 * V), "drive": ("V", U)}, STEP)
"""What most of the files hold: mm/s and volts at 50 kHz."""


def _by_csv(
    encoding: str = "utf-8", newline: str = "\r\n", before: str = "", **format: object
) -> Callable[[Path], Held]:
    """A table that the csv module writes in some format and reads back."""

    def write(path: Path) -> Held:
        text = io.StringIO()
        out = csv.writer(text, lineterminator=newline, **format)  # type: ignore[arg-type]
        out.writerow(["Time, s", "tip, mm/s", "drive, V"])
        out.writerows([f"{t:.6f}", f"{v:.4f}", f"{u:.4f}"] for t, v, u in zip(T, V, U, strict=True))
        path.write_bytes((before + text.getvalue()).encode(encoding))
        kept = {k: v for k, v in format.items() if k in ("delimiter", "quotechar")}
        back = list(csv.reader(io.StringIO(text.getvalue()), **kept))  # type: ignore[arg-type]
        _, tip, drive = np.array(back[1:], dtype=float).T
        return Held({"tip": ("m/s", 1e-3 * tip), "drive": ("V", drive)}, STEP)

    return write


def _lines(
    header: Sequence[str], row: Callable[[int], str], held: Held = HELD, encoding: str = "utf-8"
) -> Callable[[Path], Held]:
    """A header, and a row of each of the samples, by hand."""

    def write(path: Path) -> Held:
        path.write_bytes("".join(f"{line}\r\n" for line in (*header, *map(row, range(len(T))))).encode(encoding))
        return held

    return write


def _comma(number: str) -> str:
    return number.replace(".", ",")


def _plain(mark: str = ",") -> Callable[[int], str]:
    """Rows of time, tip and drive."""
    return lambda i: mark.join((f"{T[i]:.6f}", f"{V[i]:.4f}", f"{U[i]:.4f}"))


def _only(start: float, channels: dict[str, tuple[str, np.ndarray]]) -> Held:
    return Held(channels, STEP, start)


TWO = _only(0.0, {"CH1": ("V", V), "CH2": ("V", U)})
TEKTRONIX = [
    "Record Length,4e+01",
    "Sample Interval,2e-05",
    "Trigger Point,2e+01",
    "",
    "",
    "",
    "Source,CH1",
    "Vertical Units,V",
    "Vertical Scale,2e-02",
    "Horizontal Units,s",
    "Pt Fmt,Y",
    "Probe Atten,1",
]


def _tektronix(path: Path) -> Held:
    """The header of a TDS stands beside the numbers."""
    keys = [key if key else "," for key in TEKTRONIX] + [","] * (len(T) - len(TEKTRONIX))
    rows = [f"{key},,{t - 4e-4:018.12f},{v:10.5f}," for key, t, v in zip(keys, T, V, strict=True)]
    path.write_bytes("".join(f"{row}\r\n" for row in rows).encode())
    return _only(-4e-4, {"CH1": ("V", V)})


CASES = [
    Case("comma.csv", _by_csv()),
    Case("quoted.csv", _by_csv(quoting=csv.QUOTE_ALL)),
    Case("semicolon.csv", _by_csv(delimiter=";")),
    Case("tab.txt", _by_csv(delimiter="\t", newline="\n")),
    Case("byte order mark.csv", _by_csv("utf-8-sig")),
    Case("utf-16.csv", _by_csv("utf-16")),
    Case("sep line.csv", _by_csv(before="sep=;\r\n", delimiter=";")),
    Case("lines above.csv", _by_csv(before="recorded yesterday\r\nby hand, with 12 V\r\n\r\n")),
    Case("decimal comma.csv", _lines(["t [s];tip [mm/s];drive [V]"], lambda i: _comma(_plain(";")(i)))),
    Case(
        "quoted decimal comma.csv",
        _lines(
            ['"t [s]","tip [mm/s]","drive [V]"'],
            lambda i: ",".join(f'"{_comma(one)}"' for one in _plain()(i).split(",")),
        ),
    ),
    Case(
        "one column of decimal commas.csv",
        _lines(
            ["Sample rate: 50 kHz", "tip [mm/s]"],
            lambda i: _comma(f"{V[i]:.4f}"),
            _only(0.0, {"tip": HELD.channels["tip"]}),
        ),
    ),
    Case("quotes in quotes.csv", _lines(['"t, s","tip, mm/s","drive, V"'], _plain())),
    Case("cell of two lines.csv", _lines(['"t\r\n(s)","tip\r\n(mm/s)",drive (V)'], _plain())),
    Case("comments.csv", _lines(["# by a laboratory", "# t [s], tip [mm/s], drive [V]"], _plain())),
    Case("unit row.csv", _lines(["t,tip,drive", "s,mm/s,V"], _plain())),
    Case(
        "unit words.csv",
        _lines(
            ["time (msec),tip (microns/s),drive (Volts)"], lambda i: f"{1e3 * T[i]:.3f},{1e3 * V[i]:.1f},{U[i]:.4f}"
        ),
    ),
    Case("units of CF.csv", _lines(["time (s),tip (mm s-1),drive (V)"], _plain())),
    Case("units by DIN.csv", _lines(["t/s;tip / (mm/s);drive/V"], _plain(";"))),
    Case("units behind blanks.csv", _lines(["time_s,tip mm/s,drive V"], _plain())),
    Case(
        "exponents of fortran.txt",
        _lines(
            ["t (s)  tip (mm/s)  drive (V)"],
            lambda i: "  ".join(f"{one:.8E}".replace("E", "D") for one in (T[i], V[i], U[i])),
        ),
    ),
    Case(
        "times of every channel.csv",
        _lines(["t1 (s),tip (mm/s),t2 (s),drive (V)"], lambda i: f"{T[i]:.6f},{V[i]:.4f},{T[i]:.6f},{U[i]:.4f}"),
    ),
    Case(
        "microseconds since 1970.csv",
        _lines(
            ["time (us),tip (mm/s),drive (V)"],
            lambda i: f"{1780000000000000 + 20 * i},{V[i]:.4f},{U[i]:.4f}",
            Held(HELD.channels, STEP, 1.78e9),
        ),
    ),
    Case(
        "times of few digits.csv",
        _lines(
            ["Sample Interval,2e-5", "time (s),tip (mm/s),drive (V)"],
            lambda i: f"{T[i] + 1:.4f},{V[i]:.4f},{U[i]:.4f}",
            Held(HELD.channels, STEP, 1.0),
        ),
    ),
    Case(
        "thousands by points.csv",
        _lines(
            ["t (us);tip (um/s);drive (uV)"],
            lambda i: ";".join(
                f"{one:,.1f}".translate(str.maketrans(",.", ".,")) for one in (1e6 * T[i], 1e3 * V[i], 1e6 * U[i])
            ),
        ),
    ),
    Case(
        "dates.csv",
        _lines(["date,tip (mm/s),drive (V)"], lambda i: f"2026-01-01 10:00:00.{20 * i:06d},{V[i]:.4f},{U[i]:.4f}"),
    ),
    Case(
        "units behind _.csv",
        _lines(["time_us,tip_mm_s,drive_mV"], lambda i: f"{1e6 * T[i]:.0f},{V[i]:.4f},{1e3 * U[i]:.1f}"),
    ),
    Case(
        "seconds since 1970.csv",
        _lines(
            ["time (s),tip (mm/s),drive (V)"],
            lambda i: f"{1.78e9 + T[i]:.6f},{V[i]:.4f},{U[i]:.4f}",
            Held(HELD.channels, float(np.diff(1.78e9 + T[[0, -1]])[0]) / 39, 1.78e9),
        ),
    ),
    Case(
        "picoscope.csv",
        _lines(
            ["Time,Channel A,Channel B", "(ms),(mV),(V)", ""],
            lambda i: f"{1e3 * T[i]:.8f},{1e3 * V[i]:.8f},{U[i]:.8f}",
            _only(0.0, {"Channel A": ("V", V), "Channel B": ("V", U)}),
        ),
    ),
    Case(
        "rigol ds1000z.csv",
        _lines(
            ["X,CH1,CH2,Start,Increment,", "Sequence,Volt,Volt,-1.200000e-04,2.000000e-05"],
            lambda i: f"{i},{V[i]:.6e},{U[i]:.6e},",
            _only(-1.2e-4, dict(TWO.channels)),
        ),
    ),
    Case(
        "rigol mso5000.csv",
        _lines(
            ["CH1V,CH2V,t0 =-1.2e-04, tInc = 2e-05,"],
            lambda i: f"{V[i]:.6e},{U[i]:.6e},,",
            _only(-1.2e-4, dict(TWO.channels)),
        ),
    ),
    Case("tektronix tds.csv", _tektronix),
    Case(
        "tektronix mso.csv",
        _lines(
            [
                "Model,MSO4034",
                "Firmware Version,2.48",
                "",
                "Waveform Type,ANALOG",
                "Point Format,Y",
                "Horizontal Units,s",
                "Horizontal Scale,4e-06",
                "Horizontal Delay,0",
                "Sample Interval,2e-05",
                "Record Length,40",
                "Gating,0.0% to 100.0%",
                "Probe Attenuation,10,1",
                "Vertical Units,V,V",
                "Vertical Offset,0,0",
                "Vertical Scale,1,1",
                ",",
                ",",
                "Label,,",
                "TIME,CH1,CH2",
            ],
            _plain(),
            TWO,
        ),
    ),
    Case(
        "keysight infiniium.csv",
        _lines(
            [
                "Revision:,0",
                "Type:,raw",
                "Start:,0",
                "Points:,40",
                "Count:,1",
                "XDispRange:,1.0E-03",
                "XInc:,2.0E-05",
                "XOrg:,0.0",
                "XUnits:,second",
                "YUnits:,Volt",
                "Frame:,DSO9404A",
                "Date:,1 JAN 2026",
                "Time:,10:00:00",
                "Data:,",
            ],
            lambda i: f"{T[i]:.6e},{V[i]:.6e}",
            _only(0.0, {"column 2": ("V", V)}),
        ),
    ),
    Case(
        "lecroy.csv",
        _lines(
            [
                "LECROYWS104MXs,12345,Waveform",
                "Segments,1,SegmentSize,40",
                "Segment,TrigTime,TimeSinceSegment1",
                "#1,01-Jan-2026 10:00:00,0",
                "Time,Ampl",
            ],
            lambda i: f"{T[i]:.6f},{V[i]:.4f}",
            _only(0.0, {"Ampl": ("V", V)}),
        ),
        {"channels": {"Ampl": "V"}},
    ),
    Case("rohde schwarz.csv", _lines(["in s,CH1 in V,CH2 in V"], _plain(), TWO)),
    Case(
        "yokogawa.csv",
        _lines(
            [
                '"//YOKOGAWA ASCII FILE FORMAT"',
                '"Model","DL9000"',
                '"BlockNumber",1',
                '"TraceName","CH1","CH2"',
                '"BlockSize",40',
                '"VUnit","V","V"',
                '"SampleRate",5.0000E+04',
                '"HResolution",2.0E-05',
                '"HOffset",-4.0E-04',
                '"HUnit","s"',
                '"Date","2026/01/01"',
                "",
            ],
            lambda i: f"{V[i]:.5e},{U[i]:.5e}",
            _only(-4e-4, dict(TWO.channels)),
        ),
    ),
    Case(
        "polytec.txt",
        _lines(
            [
                "Source File Name:\tleg.pvd",
                "Point Index:\t3\t[x = 0\ty = 0\tz = 0]",
                "Component:\tRoot",
                "Signal:\tTime - Vib - Velocity (Größe)",
                "",
                "Time\tVelocity\tReference1",
                "[ s ]\t[ mm/s ]\t[ V ]",
            ],
            lambda i: _comma("\t".join((f"{T[i]:.8E}", f"{V[i]:.8E}", f"{U[i]:.8E}"))),
            _only(0.0, {"Velocity": ("m/s", 1e-3 * V), "Reference1": ("V", U)}),
            "latin-1",
        ),
    ),
]
