include("../../frozen", board="seeed_xiao_rp2040")  # noqa: F821
