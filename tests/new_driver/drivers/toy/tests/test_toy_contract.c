/* test_toy_contract.c - the contract of drivers, held by toy. */
#include "drivers/toy/toy.h"
#include "drivers/toy/tests/sim_toy.h"
#include "tests/drivers/contract.h"
#include "tests/drivers/cue.h"
#include "unity.h"

/* A simulator on a wire in this program. */
static struct cued_wire wire;

static const struct link_source *wire_source(void)
{
    return &wire.source;
}

static void disconnect(void)
{
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

static const char *set_up(enum contract_situation situation)
{
    const char *options = situation == CONTRACT_TAKES_TIME ? "delays=1" : "delays=0";
    cued_wire_init(&wire, wire_memory_make(&sim_toy, options));
    TEST_ASSERT_NOT_NULL(wire.wire);
    if (situation == CONTRACT_FALLS_SILENT)
        cue(&wire, "SHOT", 2, "fault silence");
    if (situation == CONTRACT_SILENT)
        wire_memory_act(wire.wire, "fault silence from 1");
    return "";
}

static const struct contract_fixture fixtures[] = {
    { .driver = &toy_driver,
      .set_up = set_up,
      .tear_down = disconnect,
      .wire = wire_source,
      .shot_ms = 2000,
      .deterministic = true },
};

void setUp(void)
{
    contract_set_up();
}

void tearDown(void)
{
    contract_tear_down();
}

int main(void)
{
    return contract_main(fixtures, sizeof fixtures / sizeof *fixtures);
}
