"""The baseline of Table III: the general problem (1) of [Fan2018], handed to IPOPT through CasADi."""
