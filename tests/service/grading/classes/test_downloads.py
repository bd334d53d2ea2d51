"""Downloads of Canvas and Moodle, and the tables that these systems export and import."""

import csv
import io
import zipfile
from pathlib import Path

import pytest

from service.grading.classes.class_records import Student
from service.grading.classes.downloads import sorted_download
from service.grading.classes.rosters import Roster
from service.grading.errors import AdjustmentError
from tests.service.grading.exports.samples import failed, not_gradable, result, tried

WANTED = ("p.png", "rays/q.npz")


def archive(**files: bytes) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as packed:
        for name, data in files.items():
            packed.writestr(name, data)
    return content.getvalue()


def sorted_files(folder: Path, **files: bytes) -> tuple[dict[str, bytes], list[str], list[str]]:
    """Files of a download, sorted: by path, with the numbers of students, and what is said of the others."""
    (folder / "class").mkdir()
    (folder / "into").mkdir()
    for name, content in files.items():
        (folder / "class" / name).parent.mkdir(exist_ok=True)
        (folder / "class" / name).write_bytes(content)
    students, left_out, troubles = sorted_download(folder / "class", folder / "into", WANTED)
    assert {student.folder for student in students} == {*(folder / "into").iterdir()}
    made = {
        path.relative_to(folder / "into").as_posix(): path.read_bytes()
        for path in (folder / "into").rglob("*")
        if path.is_file()
    }
    return made, sorted(str(student.number) for student in students), [*left_out, *troubles]


def test_canvas_download_becomes_a_folder_for_each_student(tmp_path: Path) -> None:
    files = {
        "doejane_12345_1_p.png": b"1",
        "doejane_12345_2_q_3_4.txt": b"2",
        "roe_LATE_12346_3_p-1.png": b"3",
        "müllerjörg_12347_4_p-2.png": b"again",
        "müllerjörg_12347_5_p.png": b"5",
        "o_brien_12348_6_hw.zip": archive(
            **{"hw/p.png": b"6", "hw/rays/q.npz": b"7", "__MACOSX/hw/._p": b""}
        ),
        "short_12349_7_hw.zip": archive(**{"rays/q.npz": b"8"}),
        "LATE_anon_aB3_8_p.png": b"9",
        # Unpacked by macOS: the accents are marks of their own.
        "mu\u0308ller_12354_10_p.png": b"10",
        "प्रिया_LATE_12355_11_p.png": b"11",
        "evil_12350_9_hw.zip": archive(**{"../../p.png": b""}),
        "bad_12351_9_hw.zip": b"PK",
        "torn_12352_9_hw.zip": archive(**{"p.png": bytes(range(256))}).replace(bytes(range(9)), bytes(9)),
        "notes.txt": b"",
    }
    made, numbers, others = sorted_files(tmp_path, **files)
    assert made == {
        "doejane_12345/p.png": b"1",
        "doejane_12345/q_3_4.txt": b"2",
        "roe_12346/p.png": b"3",
        "müllerjörg_12347/p-2.png": b"again",
        "müllerjörg_12347/p.png": b"5",
        "o_brien_12348/p.png": b"6",
        "o_brien_12348/rays/q.npz": b"7",
        "short_12349/rays/q.npz": b"8",
        "anon_aB3/p.png": b"9",
        "mu\u0308ller_12354/p.png": b"10",
        "प्रिया_12355/p.png": b"11",
        # Somebody should look at it: a damaged picture is open, a missing one is lost.
        "torn_12352/p.png": b"",
    }
    assert numbers == [*map(str, range(12345, 12353)), "12354", "12355", "aB3"]
    assert [words.split(" is ")[0] for words in others] == [
        "notes.txt",
        "bad_12351_9_hw.zip",
        "evil_12350_9_hw.zip",
        "torn_12352_9_hw.zip",
    ]


def test_moodle_download_becomes_a_folder_for_each_student(tmp_path: Path) -> None:
    files = {
        "Zoë van Dam_11_assignsubmission_file_/p.png": b"1",
        "Zoë van Dam_11_assignsubmission_file_/.DS_Store": b"",
        "A B_12_assignsubmission_file/hw.zip": archive(**{"p.png": b"2"}),
        "C D_13_assignsubmission_file_p.png": b"3",
        "Group A_14_assignsubmission_file/p.png": b"4",
        "C D_13_assignsubmission_onlinetext_/text.html": b"",
    }
    made, numbers, others = sorted_files(tmp_path, **files)
    assert {name: made[name] for name in made if not name.endswith(".DS_Store")} == {
        "Zoë van Dam_11/p.png": b"1",
        "A B_12/p.png": b"2",
        "C D_13/p.png": b"3",
        "Group A_14/p.png": b"4",
    }
    assert (numbers, others) == (["11", "12", "13", "14"], ["C D_13_assignsubmission_onlinetext_"])


def test_other_folders_are_no_download(tmp_path: Path) -> None:
    (tmp_path / "team_1_2_x").mkdir()
    (tmp_path / "zoe").mkdir()
    (tmp_path / "link_1_2_p.png").symlink_to(tmp_path / "zoe")
    assert sorted_download(tmp_path, tmp_path, WANTED)[0] == ()


CANVAS = """\ufeffStudent,ID,SIS Login ID,Ray tracer (77),Ray tracer two (78)
    Points Possible,,,20,5
"Doe, Jane",5,jd,,1
"=Roe",6,r,3,1
Open,7,o,4,1
Excused,10,e,EX,1
Nobody,8,n,9,1
"""
MOODLE = """Identifier;Full name;Grade;Last modified (submission);Last modified (grade)
Participant 5;"Doe; Jane";;Saturday, 21 November 2026, 8:15 PM;-
Participant 6;Roe;1;-;-
"""
GROUPS = """Identifier,Full name,Status,Group,Grade,Last modified (submission),Last modified (grade)
Participant 3,A,Submitted,Team_B,,"Sunday, November 22, 2026, 8:15 AM",-
Participant 4,B,Submitted,Team A,,-,-
Participant 5,C,Submitted,Team_B,,-,-
Participant 6,D,Submitted,A & B's,,-,-
Participant 7,E,Submitted,A &amp; B's,,-,-
"""


def test_roster_comes_back_with_points_and_nothing_else_changed() -> None:
    students = [Student(Path(f"s_{number}"), number) for number in ("5", "6", "7", "9", "10")]
    grades = [result(tried(points=2 / 3)), result(failed()), result(tried(), not_gradable())]
    grades += [result(tried()), result(tried())]
    whole = dict(zip(students, grades, strict=True))
    filled = Roster.read(CANVAS.encode()).filled(whole, "Ray tracer")
    assert filled is not None
    before, after = ([*csv.reader(io.StringIO(text))] for text in (CANVAS, filled.decode()))
    filled_in = zip(before[2:6], ["0.67", "0.0", "4", "EX"], strict=True)
    expected = [[*row[:3], points, *row[4:]] for row, points in filled_in]
    assert after == [*before[:2], *expected, before[6]]
    moodle = Roster.read(MOODLE.encode())
    assert [moodle.submitted(student) for student in students[:2]] == ["2026-11-21T20:15:00", None]
    words = (moodle.filled(whole, "Ray tracer") or b"").decode().splitlines()
    assert words[1].startswith('Participant 5;"Doe; Jane";0.67;')
    assert words[2].startswith("Participant 6;Roe;0.0;")
    assert Roster.read(b"student,submitted_at\n").filled(whole, "Ray tracer") is None


def test_groups_of_moodle_are_found_by_their_names() -> None:
    # The number is that of the group, and some participant has it too.
    group = Student(Path("Team B_4"), "4")
    roster = Roster.read(GROUPS.encode())
    assert roster.submitted(group) == "2026-11-22T08:15:00"
    filled = roster.filled({group: result(tried(points=2))}, "Ray tracer")
    points = [row["Grade"] for row in csv.DictReader(io.StringIO((filled or b"").decode()))]
    assert points == ["2.0", "", "2.0", "", ""]
    assert roster.places(Student(Path("A amp; Bs_9"), "9")) == [3, 4]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"name,submitted_at\n", "no column is called"),
        (b"student,submitted_at\na,2026-11-21\nb,Samedi 21\n", "row 3: 'Samedi 21'"),
        (b"student\na,b\n", "too long"),
    ],
)
def test_unusable_rosters_are_refused(content: bytes, said: str) -> None:
    with pytest.raises(AdjustmentError, match=said):
        Roster.read(content)
