"""Published studies reproduced, one package each."""
