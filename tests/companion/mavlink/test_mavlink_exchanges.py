"""Commands, mode changes and parameters: who asks when, and what is believed."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.mavlink.codec import Packer, decode, encode
from companion.mavlink.command_exchange import CommandExchange, CommandQueue
from companion.mavlink.commands import Ack, arm, disarm, message_interval
from companion.mavlink.dialects.base import ParameterEncoding
from companion.mavlink.dialects.px4 import Px4
from companion.mavlink.exchange import Patience, Verdict
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Outgoing, Target
from companion.mavlink.mode_change import ModeChange
from companion.mavlink.parameter_exchange import ParameterExchange
from companion.mavlink.parameters import (
    ParameterError,
    ParameterType,
    decode_value,
    encode_value,
    parameter_from_frame,
    read_request,
)

TARGET = Target(1, 1)
PATIENCE = Patience(timeout_s=0.5, attempts=3, in_progress_timeout_s=2.0)
BYTEWISE, C_CAST = ParameterEncoding.BYTEWISE, ParameterEncoding.C_CAST


def sent(outgoing, component=191):
    (frame,) = Framer().feed(Packer(1, component).pack(outgoing))
    return decode(frame)


class TestCommand:
    def test_it_is_sent_at_once_and_not_again_before_the_time_out(self):
        exchange = CommandExchange(disarm(TARGET), PATIENCE)

        assert len(exchange.outgoing(10.0)) == 1
        assert exchange.due_s == 10.5
        assert exchange.outgoing(10.49) == []

    def test_repetitions_count_themselves_and_end(self):
        exchange = CommandExchange(disarm(TARGET), PATIENCE)

        confirmations = [sent(exchange.outgoing(t)[0]).confirmation for t in (0.0, 0.5, 1.0)]

        assert confirmations == [0, 1, 2]
        assert exchange.verdict is Verdict.PENDING
        assert exchange.outgoing(1.5) == []
        assert exchange.verdict is Verdict.TIMED_OUT
        assert exchange.due_s == math.inf
        assert "COMMAND_ACK" in exchange.explanation
        assert "COMPONENT_ARM_DISARM" in exchange.explanation

    @pytest.mark.parametrize(
        ("result", "verdict"),
        [(0, Verdict.ACCEPTED), (1, Verdict.REFUSED), (3, Verdict.REFUSED), (99, Verdict.REFUSED)],
    )
    def test_an_acknowledgement_decides(self, result, verdict):
        exchange = CommandExchange(arm(TARGET), PATIENCE)
        exchange.outgoing(0.0)

        exchange.on_ack(0.1, Ack(400, result))

        assert exchange.verdict is verdict
        assert exchange.result == result
        assert exchange.outgoing(9.0) == []

    def test_a_refusal_is_told_in_words(self):
        exchange = CommandExchange(arm(TARGET), PATIENCE)
        exchange.outgoing(0.0)
        exchange.on_ack(0.1, Ack(400, 1))

        assert "temporarily rejected" in exchange.explanation

    def test_acknowledgements_of_other_commands_and_from_before_are_not_taken(self):
        exchange = CommandExchange(arm(TARGET), PATIENCE)
        exchange.on_ack(0.0, Ack(400, 0))
        exchange.outgoing(0.0)
        exchange.on_ack(0.1, Ack(22, 0))

        assert exchange.verdict is Verdict.PENDING

    def test_in_progress_stops_the_repetitions_and_waits_longer(self):
        exchange = CommandExchange(arm(TARGET), PATIENCE)
        exchange.outgoing(0.0)

        exchange.on_ack(0.3, Ack(400, 5, progress=10))

        assert exchange.outgoing(1.0) == []
        assert exchange.due_s == 2.3
        exchange.on_ack(2.0, Ack(400, 5, progress=90))
        assert exchange.due_s == 4.0
        exchange.on_ack(3.9, Ack(400, 0))
        assert exchange.verdict is Verdict.ACCEPTED

    def test_in_progress_for_ever_times_out(self):
        exchange = CommandExchange(arm(TARGET), PATIENCE)
        exchange.outgoing(0.0)
        exchange.on_ack(0.3, Ack(400, 5))

        exchange.outgoing(2.3)

        assert exchange.verdict is Verdict.TIMED_OUT
        assert "never said" in exchange.explanation


class TestArming:
    """Repeated without need it would start motors that somebody has stopped."""

    def begun(self):
        exchange = CommandExchange(arm(TARGET), PATIENCE)
        assert len(exchange.outgoing(0.0)) == 1
        return exchange

    def test_silence_alone_never_repeats_it(self):
        exchange = self.begun()
        times = [t / 10 for t in range(1, 100)]

        assert [t for t in times if exchange.outgoing(t)] == []
        assert exchange.verdict is Verdict.TIMED_OUT
        assert "no HEARTBEAT" in exchange.explanation

    def test_a_heartbeat_that_says_armed_answers_it(self):
        exchange = self.begun()

        exchange.on_heartbeat(0.1, armed=True)

        assert exchange.verdict is Verdict.ACCEPTED
        exchange.on_heartbeat(1.1, armed=False)
        assert exchange.outgoing(1.1) == []
        assert exchange.due_s == math.inf

    def test_it_is_repeated_when_a_later_heartbeat_says_disarmed_and_only_so_often(self):
        exchange = self.begun()

        exchange.on_heartbeat(0.4, armed=False)  # may have been made before it arrived
        assert exchange.outgoing(0.6) == []
        sent_s = []
        for t in (1.4, 2.4, 3.4, 4.4):
            exchange.on_heartbeat(t, armed=False)
            assert exchange.outgoing(t) == []  # who has reasons to end it can
            sent_s += [t for _ in exchange.outgoing(t + 0.11)]

        assert sent_s == [1.4, 2.4]
        assert exchange.verdict is Verdict.TIMED_OUT
        assert "no COMMAND_ACK" in exchange.explanation

    def test_a_heartbeat_says_nothing_of_other_commands(self):
        exchange = CommandExchange(disarm(TARGET), PATIENCE)
        exchange.outgoing(0.0)

        exchange.on_heartbeat(0.1, armed=True)

        assert exchange.verdict is Verdict.PENDING

    def test_a_restarted_autopilot_is_not_armed_again(self):
        queue = CommandQueue(PATIENCE)
        exchange = queue.submit(arm(TARGET))
        queue.outgoing(0.0)

        queue.on_restart()
        queue.on_heartbeat(1.0, armed=False)

        assert queue.outgoing(1.0) == []
        assert exchange.verdict is Verdict.TIMED_OUT

    def test_an_acknowledgement_that_comes_after_the_heartbeat_is_not_the_next_commands(self):
        queue = CommandQueue(PATIENCE)
        queue.submit(arm(TARGET))
        queue.outgoing(0.0)
        queue.on_heartbeat(0.1, armed=True)
        taken_back = queue.submit(disarm(TARGET))

        assert queue.outgoing(0.1) == []
        queue.on_ack(0.2, Ack(400, 0))
        assert taken_back.verdict is Verdict.PENDING
        assert len(queue.outgoing(0.2)) == 1


class TestQueue:
    def test_commands_of_one_id_go_one_after_another(self):
        queue = CommandQueue(PATIENCE)
        first = queue.submit(message_interval(TARGET, 331, 0.01))
        second = queue.submit(message_interval(TARGET, 436, 0.1))

        assert [sent(o).param1 for o in queue.outgoing(0.0)] == [331]
        queue.on_ack(0.01, Ack(511, 4))
        assert queue.due_s <= 0.01
        assert [sent(o).param1 for o in queue.outgoing(0.01)] == [436]
        queue.on_ack(0.02, Ack(511, 0))

        assert (first.verdict, second.verdict) == (Verdict.REFUSED, Verdict.ACCEPTED)
        assert queue.idle
        assert queue.due_s == math.inf

    def test_a_command_that_nobody_answers_does_not_block_the_next(self):
        queue = CommandQueue(PATIENCE)
        first = queue.submit(message_interval(TARGET, 148, 0.1))
        queue.submit(message_interval(TARGET, 242, 0.1))

        for t in (0.0, 0.5, 1.0):
            assert sent(queue.outgoing(t)[0]).param1 == 148
        assert [sent(o).param1 for o in queue.outgoing(1.5)] == [242]
        assert first.verdict is Verdict.TIMED_OUT

    def repeated(self):
        """A queue whose first command was sent at 0 and 0.5 s and answered at 0.55 s."""
        queue = CommandQueue(PATIENCE)
        first = queue.submit(message_interval(TARGET, 331, 0.01))
        second = queue.submit(message_interval(TARGET, 436, 0.1))
        assert [len(queue.outgoing(t)) for t in (0.0, 0.5)] == [1, 1]
        queue.on_ack(0.55, Ack(511, 0))
        assert first.verdict is Verdict.ACCEPTED
        return queue, second

    def test_the_answer_to_a_repetition_is_not_taken_for_the_next_commands(self):
        queue, second = self.repeated()

        assert queue.outgoing(0.55) == []
        queue.on_ack(0.57, Ack(511, 0))
        assert second.verdict is Verdict.PENDING
        assert [sent(o).param1 for o in queue.outgoing(0.57)] == [436]
        queue.on_ack(0.58, Ack(511, 3))

        assert second.verdict is Verdict.REFUSED
        assert queue.idle

    def test_an_answer_to_a_repetition_that_never_comes_holds_the_next_command_for_a_moment(self):
        queue, second = self.repeated()

        assert queue.outgoing(0.99) == []
        assert queue.due_s == 1.0
        assert [sent(o).param1 for o in queue.outgoing(1.0)] == [436]
        queue.on_ack(1.01, Ack(511, 0))

        assert second.verdict is Verdict.ACCEPTED
        queue.submit(message_interval(TARGET, 245, 0.1))
        assert len(queue.outgoing(1.01)) == 1, "one lost packet costs one wait"

    def test_a_repetition_holds_no_command_of_another_id(self):
        queue = CommandQueue(PATIENCE)
        queue.submit(message_interval(TARGET, 331, 0.01))
        queue.submit(arm(TARGET))
        queue.outgoing(0.0)
        queue.outgoing(0.5)
        queue.on_ack(0.55, Ack(511, 0))

        assert sent(queue.outgoing(0.55)[0]).command == 400

    def test_the_answer_to_a_command_that_was_dropped_is_not_the_next_ones(self):
        queue = CommandQueue(PATIENCE)
        dropped = queue.submit(arm(TARGET))
        queue.outgoing(0.0)
        dropped.verdict = Verdict.TIMED_OUT
        second = queue.submit(disarm(TARGET))

        assert queue.outgoing(0.01) == []
        queue.on_ack(0.02, Ack(400, 0))
        assert len(queue.outgoing(0.02)) == 1
        assert second.verdict is Verdict.PENDING


class TestModeChange:
    def change(self):
        px4 = Px4()
        return ModeChange(
            px4.set_mode(TARGET, "offboard"), px4.custom_mode("offboard"), "offboard", PATIENCE
        )

    def test_the_first_acknowledgement_proves_nothing(self):
        change = self.change()
        change.outgoing(0.0)

        change.on_ack(0.01, Ack(176, 0))
        assert change.verdict is Verdict.PENDING
        change.on_ack(0.02, Ack(176, 1))

        assert change.verdict is Verdict.REFUSED
        assert "temporarily rejected" in change.explanation

    def test_two_good_acknowledgements_prove_nothing_either(self):
        change = self.change()
        change.outgoing(0.0)
        change.on_ack(0.01, Ack(176, 0))
        change.on_ack(0.02, Ack(176, 0))

        assert change.verdict is Verdict.PENDING

    def test_the_reported_mode_proves_it(self):
        change = self.change()
        change.outgoing(0.0)
        change.on_mode(Px4().custom_mode("loiter"))
        assert change.verdict is Verdict.PENDING

        change.on_mode(Px4().custom_mode("offboard"))

        assert change.verdict is Verdict.ACCEPTED
        assert change.outgoing(5.0) == []

    def test_without_the_mode_it_asks_again_and_then_says_what_was_missing(self):
        change = self.change()
        for t in (0.0, 0.5, 1.0):
            assert sent(change.outgoing(t)[0]).command == 176
            change.on_ack(t, Ack(176, 0))

        assert change.outgoing(1.5) == []
        assert change.verdict is Verdict.TIMED_OUT
        assert "CURRENT_MODE" in change.explanation
        assert "acknowledged" in change.explanation


class TestParameterValues:
    @settings(deadline=None, derandomize=True)
    @given(st.integers(-(2**31), 2**31 - 1))
    def test_every_integer_survives_bytewise_nans_included(self, value):
        # The bytes of many of these integers are those of a NaN.
        data = encode_value(value, ParameterType.INT32, BYTEWISE)
        assert data == struct.pack("<i", value)
        assert decode_value(data, ParameterType.INT32, BYTEWISE) == value

    @settings(deadline=None, derandomize=True)
    @given(st.integers(-(2**24), 2**24))
    def test_integers_survive_the_c_cast_as_far_as_floats_hold_them(self, value):
        data = encode_value(value, ParameterType.INT32, C_CAST)
        assert data == struct.pack("<f", float(value))
        assert decode_value(data, ParameterType.INT32, C_CAST) == value

    @pytest.mark.parametrize("kind", list(ParameterType))
    @pytest.mark.parametrize("encoding", [BYTEWISE, C_CAST])
    def test_every_type_takes_four_bytes_and_comes_back(self, kind, encoding):
        data = encode_value(100, kind, encoding)

        assert len(data) == 4
        assert decode_value(data, kind, encoding) == 100

    @pytest.mark.parametrize(
        ("value", "kind"),
        [
            (math.nan, ParameterType.REAL32),
            (1e39, ParameterType.REAL32),
            (1.5, ParameterType.INT32),
            (2**31, ParameterType.INT32),
            (-1, ParameterType.UINT8),
        ],
    )
    def test_values_that_do_not_fit_are_refused(self, value, kind):
        with pytest.raises(ParameterError):
            encode_value(value, kind, BYTEWISE)

    @pytest.mark.parametrize("name", ["", "SEVENTEEN_LETTERS", "MÜLL"])
    def test_names_that_cannot_be_are_refused(self, name):
        with pytest.raises(ParameterError, match="names"):
            read_request(name, TARGET)


def value_frame(name, value, kind=ParameterType.INT32, encoding=BYTEWISE):
    payload = struct.pack(
        "<4sHH16sB", encode_value(value, kind, encoding), 1, 0, name.encode(), kind
    )
    (frame,) = Framer().feed(Packer(1, 1).pack(Outgoing(22, payload)))
    return frame


def error_frame(name, error):
    (frame,) = Framer().feed(
        Packer(1, 1).pack(
            encode(
                "PARAM_ERROR",
                target_system=1, target_component=191, param_id=name.encode(), param_index=-1,
                error=error,
            )
        )
    )  # fmt: skip
    return frame


class TestParameterExchange:
    def test_a_read_ends_with_the_value(self):
        exchange = ParameterExchange("COM_OBL_RC_ACT", TARGET, BYTEWISE, patience=PATIENCE)
        request = sent(exchange.outgoing(0.0)[0])
        exchange.on_frame(value_frame("OTHER", 7))
        assert exchange.verdict is Verdict.PENDING

        exchange.on_frame(value_frame("COM_OBL_RC_ACT", 5))

        assert (request.param_id, request.param_index) == ("COM_OBL_RC_ACT", -1)
        assert exchange.verdict is Verdict.ACCEPTED
        assert exchange.parameter.value == 5

    def test_a_write_learns_the_type_first_and_is_believed_when_reported(self):
        exchange = ParameterExchange("COM_OBL_RC_ACT", TARGET, BYTEWISE, 5, PATIENCE)
        assert sent(exchange.outgoing(0.0)[0]).get_type() == "PARAM_REQUEST_READ"
        exchange.on_frame(value_frame("COM_OBL_RC_ACT", 0))

        setting = sent(exchange.outgoing(0.01)[0])
        exchange.on_frame(value_frame("COM_OBL_RC_ACT", 0))
        assert exchange.verdict is Verdict.PENDING, "a late answer to the read"
        exchange.on_frame(value_frame("COM_OBL_RC_ACT", 5))

        assert setting.get_type() == "PARAM_SET"
        assert setting.param_type == ParameterType.INT32
        assert struct.pack("<f", setting.param_value) == struct.pack("<i", 5)
        assert exchange.verdict is Verdict.ACCEPTED

    def test_a_value_that_is_right_already_is_not_written(self):
        exchange = ParameterExchange("MPC_THR_HOVER", TARGET, BYTEWISE, 0.3, PATIENCE)
        exchange.outgoing(0.0)

        exchange.on_frame(value_frame("MPC_THR_HOVER", 0.3, ParameterType.REAL32))

        assert exchange.verdict is Verdict.ACCEPTED
        assert exchange.outgoing(1.0) == []

    def test_a_value_that_stays_is_a_refusal(self):
        exchange = ParameterExchange("COM_OBL_RC_ACT", TARGET, C_CAST, 5, PATIENCE)
        exchange.outgoing(0.0)
        for step in range(5):
            exchange.on_frame(value_frame("COM_OBL_RC_ACT", 3, encoding=C_CAST))
            exchange.outgoing(0.1 + step)

        assert exchange.verdict is Verdict.REFUSED
        assert "still 3, not 5" in exchange.explanation

    def test_errors_are_told_in_words(self):
        exchange = ParameterExchange("NO_SUCH", TARGET, BYTEWISE, patience=PATIENCE)
        exchange.outgoing(0.0)

        exchange.on_frame(error_frame("NO_SUCH", 1))

        assert exchange.verdict is Verdict.REFUSED
        assert "no such parameter" in exchange.explanation

    def test_silence_is_a_time_out(self):
        exchange = ParameterExchange("COM_OBL_RC_ACT", TARGET, BYTEWISE, patience=PATIENCE)
        for t in (0.0, 0.5, 1.0, 1.5):
            exchange.outgoing(t)

        assert exchange.verdict is Verdict.TIMED_OUT
        assert "PARAM_VALUE" in exchange.explanation

    def test_a_value_that_the_type_cannot_hold_is_refused_before_it_is_sent(self):
        exchange = ParameterExchange("COM_OBL_RC_ACT", TARGET, BYTEWISE, 5.5, PATIENCE)
        exchange.outgoing(0.0)
        exchange.on_frame(value_frame("COM_OBL_RC_ACT", 0))

        assert exchange.outgoing(0.1) == []
        assert exchange.verdict is Verdict.REFUSED
        assert "5.5" in exchange.explanation

    def test_a_type_that_the_field_cannot_hold_is_no_parameter(self):
        payload = struct.pack("<4sHH16sB", b"\0" * 4, 1, 0, b"BIG", 7)
        (frame,) = Framer().feed(Packer(1, 1).pack(Outgoing(22, payload)))

        assert parameter_from_frame(frame, BYTEWISE) is None
