"""The configuration page of a sensor: a published one, and corrupted ones."""

import pytest

from needleforce import InputError
from needleforce.wire.net_ft import SensorConfiguration, parse_configuration

PAGE = (
    b'<?xml version="1.0"?><netft><runstat>0x00000000</runstat><runrate>7000</runrate><cfgcalsn>FT1</cfgcalsn>'
    b"<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>"
    b"<cfgmr>12;12;17;0.12;0.12;0.12</cfgmr><comrdtrate>1000</comrdtrate></netft>"
)


def test_counts_become_newtons():
    known = parse_configuration(PAGE, "sensor")
    assert known == SensorConfiguration(1e6, 1e6, 1000.0, "FT1", (12.0, 12.0, 17.0, 0.12, 0.12, 0.12))
    assert known.wrench((1_000_000, -500_000, 0, 1000, 0, 1)) == (1.0, -0.5, 0.0, 1e-3, 0.0, 1e-6)


def test_other_units_are_converted():
    page = PAGE.replace(b"<scfgfu>N<", b"<scfgfu>lbf<").replace(b"<scfgtu>Nm<", b"<scfgtu>N-mm<")
    known = parse_configuration(page, "sensor")
    assert known.counts_per_force == pytest.approx(1e6 / 4.4482216152605)
    assert known.counts_per_torque == pytest.approx(1e9)
    assert known.ratings[2] == pytest.approx(17 * 4.4482216152605)


def test_a_configuration_is_unchanged_by_writing_and_reading():
    known = SensorConfiguration(1e6, 2e6, 7000.0, "a<b&c", (12.0, 12.0, 17.0, 0.12, 0.12, 0.12))
    assert parse_configuration(known.xml(), "itself") == known


@pytest.mark.parametrize(
    "old, new, what",
    [
        (b"<cfgcpf>1000000<", b"<cfgcpf>0<", "<cfgcpf>"),
        (b"<cfgcpf>1000000<", b"<cfgcpf>many<", "<cfgcpf>"),
        (b"<cfgcpt>1000000</cfgcpt>", b"", "<cfgcpt>"),
        (b"<comrdtrate>1000<", b"<comrdtrate>nan<", "<comrdtrate>"),
        (b"<comrdtrate>1000<", b"<comrdtrate>1_000<", "<comrdtrate>"),
        (b"<scfgfu>N<", b"<scfgfu>stone<", "<scfgfu>"),
        (b"</netft>", b"", "not readable"),
        (b"<netft>", b'<!DOCTYPE a [<!ENTITY b "c">]><netft>', "not readable"),
    ],
)
def test_a_corrupted_page_is_refused_with_its_tag(old, new, what):
    assert old in PAGE
    with pytest.raises(InputError, match=f"sensor: .*{what}"):
        parse_configuration(PAGE.replace(old, new), "sensor")


def test_invalid_ratings_count_as_unknown():
    assert parse_configuration(PAGE.replace(b"12;12;17", b"12;x;17"), "sensor").ratings == (0.0,) * 6
