"""MSP payloads wait in the receiver until the main loop takes them."""

from behaviour.support import equal, frame, heap_lock, heap_unlock
from ghst import Receiver, decoder


def _payload(number):
    return bytes((number & 0xFF, number >> 8, 3, 4, 5, 6, 7, 8, 9, 255 - (number & 0xFF)))


def _receiver(numbers):
    receiver = Receiver()
    for number in numbers:
        receiver.feed(frame(0x21 + number % 2, _payload(number), 0x82))
    return receiver


def _taken(receiver):
    payload = bytearray(10)
    taken = []
    while receiver.next_msp(payload):
        taken.append(bytes(payload))
    return taken


def nothing_waits_at_first():
    receiver = Receiver()
    payload = bytearray(b"unchanged!")
    equal(receiver.next_msp(payload), False)
    equal(payload, b"unchanged!")
    equal(receiver.msp_lost, 0)


def payloads_come_in_order_and_once():
    receiver = _receiver(range(3))
    equal(_taken(receiver), [_payload(number) for number in range(3)])
    equal(_taken(receiver), [])
    receiver.feed(frame(0x21, _payload(77), 0x82))
    equal(_taken(receiver), [_payload(77)])
    equal(receiver.msp_lost, 0)


def eight_wait():
    receiver = _receiver(range(8))
    equal(_taken(receiver), [_payload(number) for number in range(8)])
    equal(receiver.msp_lost, 0)


def newer_ones_take_the_place_of_the_oldest():
    receiver = _receiver(range(20))
    equal(_taken(receiver), [_payload(number) for number in range(12, 20)])
    equal(receiver.msp_lost, 12)
    equal(receiver.msp_frames, 20)


def short_and_foreign_ones_do_not_wait():
    receiver = Receiver()
    receiver.feed(frame(0x21, _payload(1)[:9], 0x82))
    receiver.feed(frame(0x21, _payload(1), 0x89))
    receiver.feed(frame(0x23, _payload(1), 0x82))
    equal(_taken(receiver), [])


def the_count_may_wrap():
    receiver = Receiver()
    decoder.set_word(receiver.memory, decoder.MSP_FRAMES, decoder.COUNTER_MASK - 1)
    receiver._msp_read = decoder.COUNTER_MASK - 1
    for number in range(5):
        receiver.feed(frame(0x22, _payload(number), 0x82))
    equal(receiver.msp_frames, 3)
    equal(_taken(receiver), [_payload(number) for number in range(5)])
    equal(receiver.msp_lost, 0)


def one_that_is_overwritten_while_it_is_read_is_dropped():
    # What the interrupt may do between two bytes of the copy.
    receiver = _receiver(range(8))

    class Interrupted:
        def __init__(self):
            self.data = bytearray(10)
            self.armed = True

        def __setitem__(self, at, value):
            self.data[at] = value
            if at == 5 and self.armed:
                self.armed = False
                for number in range(8, 10):
                    receiver.feed(frame(0x21, _payload(number), 0x82))

    payload = Interrupted()
    equal(receiver.next_msp(payload), True)
    equal(payload.data, _payload(2))
    equal(receiver.msp_lost, 2)


def taking_allocates_nothing():
    receiver = _receiver(range(20))
    payload = bytearray(10)
    heap_lock()
    try:
        while receiver.next_msp(payload):
            pass
    finally:
        heap_unlock()
    equal(receiver.msp_lost, 12)


def a_video_setting_of_another_frame_does_not_disturb_the_queue():
    receiver = _receiver(range(2))
    receiver.feed(frame(0x20, bytes(range(10)), 0x83))
    receiver.feed(frame(0x14, bytes(range(10)), 0x82))
    equal(_taken(receiver), [_payload(0), _payload(1)])
    equal(receiver.vtx_flags, 0)
    equal(receiver.vtx_freq_mhz, 0x0201)
    equal(receiver.vtx_control, bytes((6, 7, 8, 9)))
