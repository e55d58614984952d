"""Records of messages, their encoding, and their checksum."""

import numpy as np
import pytest

from iowbc.onboard import messages
from iowbc.onboard.messages import Record


def filled(kind: "np.dtype[np.void]") -> Record:
    """A message of other bytes in every number."""
    bytes_ = np.random.default_rng(0).integers(1, 120, kind.itemsize, np.uint8)
    return messages.from_cdr(kind, messages.to_cdr(bytes_.view(kind).reshape(())))


@pytest.mark.parametrize(
    ("kind", "size"), [(messages.LOW_COMMAND, 1004), (messages.LOW_STATE, 2092), (messages.BATTERY_STATE, 168)]
)
def test_a_message_survives_the_wire_in_as_many_bytes_as_its_definition_takes(
    kind: "np.dtype[np.void]", size: int
) -> None:
    message = filled(kind)
    data = messages.to_cdr(message)
    assert len(data) == size
    assert messages.to_cdr(messages.from_cdr(kind, data)) == data


def test_numbers_on_the_wire_are_aligned_to_their_own_size() -> None:
    command = messages.empty(messages.LOW_COMMAND)
    command["mode_pr"], command["mode_machine"] = 1, 5
    command["motor_cmd"]["mode"][0], command["motor_cmd"]["q"][0] = 7, 1.0
    data = messages.to_cdr(command)
    assert data[:8] == b"\x00\x01\x00\x00\x01\x05\x07\x00"
    assert data[8:12] == np.float32(1.0).tobytes()


def test_bytes_of_another_message_are_refused() -> None:
    with pytest.raises(ValueError, match="LowState_: 1004 bytes"):
        messages.from_cdr(messages.LOW_STATE, messages.to_cdr(messages.empty(messages.LOW_COMMAND)))


def test_the_checksum_is_that_of_the_words_shifted_out_bit_by_bit() -> None:
    message, register = filled(messages.LOW_COMMAND), 0xFFFFFFFF
    for word in np.frombuffer(message.tobytes(), "<u4")[:-1].tolist():
        for bit in range(31, -1, -1):
            out = register >> 31
            register = register << 1 & 0xFFFFFFFF
            register ^= 0x04C11DB7 * (out ^ (word >> bit & 1))
    assert messages.checksum(message) == register


def test_the_idl_text_names_every_field_and_nested_type() -> None:
    text = messages.idl(messages.LOW_STATE)
    assert "MotorState_ motor_state[35];" in text
    assert "struct IMUState_" in text
    assert "octet wireless_remote[40];" in text
