"""Lines of a teach pendant's program: read, printed, refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_config.programs.tp.expressions import Cursor, LineError, expression
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import (
    AssignLine,
    Binary,
    Bracket,
    Call,
    Case,
    Expression,
    For,
    If,
    Indexed,
    Jump,
    MotionLine,
    Name,
    PulseTime,
    Select,
    Unary,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.printer import print_expression, print_line

SAME = [
    "J P[1] 50% FINE",
    "J P[1:over the part] 50% CNT100 ACC80 Offset,PR[2:shift]",
    "L P[2] R[11:speed]mm/sec CNT R[12] Offset,PR[1]",
    "L PR[R[98]] 700mm/sec FINE Tool_Offset,PR[10]",
    "L P[3] 4sec FINE",
    "L P[3] 250msec CNT0",
    "L P[3] max_speed FINE",
    "L P[6] 20mm/sec FINE TB 1.00sec,DO[129:air jet]=PULSE,0.6sec",
    "L P[6] 20mm/sec FINE Skip,LBL[99],PR[99]=LPOS",
    "R[1]=R[2]-R[3]+4",
    "R[1:of R[2]]=-10.1",
    "R[R[90]]=R[R[90]]+1",
    "R[4]=R[5] DIV 3",
    "R[6]=(R[4]-((R[2]*R[5])+1))",
    "PR[10,1:shift]=(47.74*(R[2]-1))",
    "PR[GP2:1,7]=PR[GP2:1,7]-R[15]",
    "PR[1]=LPOS-LPOS",
    "PR[89]=P[R[159]]",
    "F[1]=(!F[2] AND (DI[3] OR RI[1]=ON))",
    "DO[1]=PULSE,.5sec",
    "GO[1]=GI[2]",
    "TIMER[1]=RESET",
    "$WAITTMOUT=200",
    "UFRAME[19:hold]=PR[R[99]]",
    "UTOOL_NUM=R[5]",
    "OVERRIDE=50%",
    "OVERRIDE=R[50]",
    "LBL[10:again]",
    "JMP LBL[R[1]]",
    "IF R[1]<>5,CALL OTHER(1,R[2],'text',(-3))",
    "IF (DI[1] AND !DI[2]),R[3]=(5)",
    "IF (R[1]=1 OR R[1]=2) THEN",
    "SELECT R[1]=1,JMP LBL[1]",
    "=(-45),CALL OTHER",
    "ELSE,JMP LBL[99]",
    "FOR R[1]=10 DOWNTO R[2]",
    "WAIT R[5]",
    "WAIT DI[3]=ON+ TIMEOUT,LBL[4]",
    "WAIT (RI[1]) TIMEOUT,LBL[4]",
    "WAIT (F[30] AND DI[1]=OFF OR F[31]=OFF)",
    "WAIT R[1]=1 AND R[2]=1 AND R[3]=1",
    "RUN OTHER",
    "CALL SR[1]",
    "SKIP CONDITION $MISC[1].$HPD_TRQ[2]>R[3] OR DI[1]=ON",
    "OFFSET CONDITION PR[3]",
    "PAYLOAD[2:full]",
    "UALM[1]",
    "MESSAGE[who is [here]?]",
    "LOCK PREG",
    "ABORT",
    "ENDFOR",
    "!a remark, 100 %",
    "//CALL OTHER",
    "--eg:a remark of the editor",
    "",
]


@pytest.mark.parametrize("text", SAME)
def test_what_is_read_is_printed_as_it_was(text: str) -> None:
    """Brackets, comments and options too; blanks may differ."""
    assert print_line(read_line(text)).split() == text.split()


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "C P[1]    \n  P[2] 100mm/sec CNT50 PTH",
            MotionLine(
                "C",
                (Indexed("P", (1.0,)), Indexed("P", (2.0,))),
                100.0,
                "mm/sec",
                50.0,
                ("PTH",),
            ),
        ),
        ("WAIT    .25(sec)", Wait(0.25)),
        (
            "WAIT RI[1]=ON",
            WaitUntil(Binary("=", Indexed("RI", (1.0,)), Name("ON"))),
        ),
        (
            "IF (R[1]-.5>2),DO[3]=PULSE",
            If(
                Bracket(Binary(">", Binary("-", Indexed("R", (1.0,)), 0.5), 2.0)),
                AssignLine(Indexed("DO", (3.0,)), PulseTime()),
            ),
        ),
        (
            "SELECT R[1]=2,CALL A-B_2",
            Select(Indexed("R", (1.0,)), 2.0, Call("A-B_2")),
        ),
        ("ELSE ,JMP LBL[3]", Case(None, Jump(Indexed("LBL", (3.0,))))),
        ("FOR R[1]=1 TO 3", For(Indexed("R", (1.0,)), 1.0, 3.0)),
        ("LOCK  PREG", Word("LOCK PREG")),
    ],
)
def test_a_line_is_one_struct(text: str, line: object) -> None:
    """Times, cases and signals are told apart."""
    assert read_line(text) == line


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("GRIP 1", "no instruction begins so"),
        ("R[1]", "no instruction begins so"),
        ("R[1]=", "a value is expected at ''"),
        ("DO[1]=PERHAPS", "a value is expected at 'PERHAPS'"),
        ("R[1]=(R[2]", "a closing bracket is expected at ''"),
        ("R[1]=R[2] R[3]", r"'R\[3\]' is not understood"),
        ("J P[1] 50 FINE", "a unit of speed is expected at 'FINE'"),
        ("J P[1] 50% STOP", "FINE or CNT is expected at 'STOP'"),
        ("!first; second", "a semicolon ends the line, in a remark too"),
        ("J P[1] 50% FINE Quickly", "'Quickly' is no option of a motion"),
        ("J R[1] 50% FINE", "no instruction begins so"),
        ("C P[1] 100mm/sec FINE", "P or PR is expected at '100mm/sec FINE'"),
        ("JMP LABEL", "LBL is expected at 'LABEL'"),
        ("IF R[1]=1", "a comma or THEN is expected"),
        ("FOR R[1]=1 UP 3", "TO or DOWNTO is expected"),
        ("R[1]=" + 1000 * "(" + "1", "more than 40 operands stand within each other"),
        ("WAIT DI[1]=ON TIMEOUT,5", "LBL is expected at '5'"),
        ("WAIT DI[1]=ON AND DI[2]=OFF OR DI[3]=OFF", "AND and OR cannot stand together in a cond"),
        ("IF R[1]=1 OR R[2]=1 AND R[3]=1,JMP LBL[1]", r"brackets around all of it, \(A AND \(B"),
        ("IF (R[1]=1) AND R[2]=1 OR R[3]=1 THEN", "AND and OR cannot stand together"),
        ("SKIP CONDITION DI[1]=ON OR DI[2]=ON AND DI[3]=ON", "AND and OR cannot stand together"),
    ],
)
def test_what_is_not_understood_is_refused(text: str, said: str) -> None:
    """The text says what was expected and what stands there."""
    with pytest.raises(LineError, match=said):
        read_line(text)


def test_mixed_logic_binds_as_the_manual_says() -> None:
    """``!`` first, then products, sums, comparisons, AND, OR; from the left."""
    found = expression(Cursor("!F[1] OR R[1]-2-3*4<=R[2] AND F[2]"))
    f1, f2 = (Indexed("F", (n,)) for n in (1.0, 2.0))
    r1, r2 = (Indexed("R", (n,)) for n in (1.0, 2.0))
    difference = Binary("-", Binary("-", r1, 2.0), Binary("*", 3.0, 4.0))
    compared = Binary("<=", difference, r2)
    assert found == Binary("OR", Unary("!", f1), Binary("AND", compared, f2))


def _expressions() -> st.SearchStrategy[Expression]:
    numbers = st.integers(0, 9999).map(float) | st.floats(0.001, 999.0).map(
        lambda value: round(value, 3)
    )
    comments = st.text("abc XYZ-_.,0", max_size=6).map(str.strip)
    variables = st.builds(
        lambda kind, index, comment: Indexed(kind, (index,), comment=comment),
        st.sampled_from(("R", "DI", "RO", "AR", "F")),
        st.integers(1, 99).map(float),
        comments,
    )
    return st.recursive(
        numbers | variables,
        lambda inner: (
            st.builds(Bracket, inner)
            | st.builds(
                Binary,
                st.sampled_from(("+", "*", "DIV", "<=", "AND", "OR")),
                inner.map(Bracket),
                inner.map(Bracket),
            )
            | st.builds(Unary, st.just("!"), inner.map(Bracket))
        ),
        max_leaves=8,
    )


@given(_expressions())
def test_any_expression_is_read_as_it_was_printed(found: Expression) -> None:
    """No digit, bracket or comment is lost."""
    cursor = Cursor(print_expression(found))
    assert expression(cursor) == found
    cursor.end()
