"""The commands that talk to a service, one module each; they need the extra ``cli``.

With the whole of Fingersplit installed they are commands of `fingersplit`; where only the client is, of
`fingersplit-client`. A new one is a module here with a function of its name, and a line among the
entry points ``fingersplit.commands``.
"""
